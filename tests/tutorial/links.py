"""Links of a page: to files that exist, and to headings that are there."""

import functools
import re


@functools.cache
def headings(path):
    """The anchors of a page, as GitHub makes them: lower case, blanks as -, other signs dropped."""
    text = re.sub(r"^```\w*\n.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    titles = [line.lstrip("#").strip().lower() for line in text.splitlines() if re.match(r"#+ ", line)]
    return {re.sub(r"[^\w\- ]", "", title).replace(" ", "-") for title in titles} | set(re.findall(r'<a id="([^"]+)">', text))


def fault(page, text):
    """The first link that leads nowhere; None where all lead somewhere."""
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists():
            return f"a link to {target}, which does not exist"
        if anchor and anchor not in headings(file):
            return f"a link to {target}, where no such heading is"
    return None

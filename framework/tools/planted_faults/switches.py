"""All faults in one copy of the sources, each behind a switch: (planted::fault(17) ? FAULTY : RIGHT) in place of an expression. Which fault
is at work is said when a program starts, so that nothing has to be built again."""

import re
from dataclasses import dataclass, field

from faults import code_of, without_comments

OPENING, CLOSING = "([{", ")]}"
LITERALS = ("constant", "one", "bound", "index")   # stand alone; of all others the expression around them is written twice


def is_assignment(code, k):
    return code[k] == "=" and code[k - 1] not in "=<>!" and code[k + 1] != "="


def expression_around(code, place, logical):
    """Begin and end of the widest expression at `place`: to a bracket, comma, semicolon, assignment or condition; of && and || too, unless
    the fault is one of these (`logical`)."""
    def ends_here(k):
        return (code[k] in ",;" or is_assignment(code, k) or code[k] == "?" or (code[k] == ":" and ":" not in (code[k - 1], code[k + 1]))
                or (not logical and code[k:k + 2] in ("&&", "||")))
    depth, begin = 0, place
    while begin > 0:
        k = begin - 1
        if code[k] in CLOSING:
            depth += 1
        elif code[k] in OPENING:
            if depth == 0:
                break
            depth -= 1
        elif depth == 0 and (ends_here(k) or (not logical and k > 0 and code[k - 1:k + 1] in ("&&", "||")) or code[k - 6:k + 1] == "return "):
            break
        begin = k
    depth, end = 0, place
    while end < len(code):
        if code[end] in OPENING:
            depth += 1
        elif code[end] in CLOSING:
            if depth == 0:
                break
            depth -= 1
        elif depth == 0 and end > place and ends_here(end):
            break
        end += 1
    return begin + len(code[begin:end]) - len(code[begin:end].lstrip()), begin + len(code[begin:end].rstrip())


def assignment_around(code, place):
    """Begin and end of x[i].y += z, where += stands at `place`."""
    begin, depth = place - 1, 0
    while depth > 0 or re.match(r"[\w.:)\]]", code[begin - 1]) or code[begin - 2:begin] == "->" or code[begin - 1:begin + 1] == "->":
        begin -= 1
        depth += (code[begin] in CLOSING) - (code[begin] in OPENING)
    while code[begin - 1] == "*":
        begin -= 1
    return begin, expression_around(code, place + 2, True)[1]


@dataclass
class Region:
    """A piece of the text that is written again for some faults: a place, old and new text, and a number for each."""
    begin: int
    end: int
    faults: list = field(default_factory=list)
    inner: list = field(default_factory=list)


def regions_of(text, code, faults):
    """Nested, from pairs (number, fault); and the numbers of those that no region holds without cutting another in two."""
    found, cut = {}, []
    for number, fault in faults:
        place = fault.place(text)
        if fault.kind in LITERALS or fault.old in ("true", "false"):
            span = (place, place + len(fault.old))
        elif fault.old in ("+=", "-="):
            span = assignment_around(code, place)
        else:
            span = expression_around(code, place, fault.old in ("&&", "||"))
        if any(a < span[0] < b < span[1] or span[0] < a < span[1] < b for a, b in found):
            cut.append(number)
            continue
        found.setdefault(span, Region(*span)).faults.append((place, fault, number))
    outermost = []
    for region in sorted(found.values(), key=lambda r: (r.begin, -r.end)):
        around, level = None, outermost
        while level and level[-1].end >= region.end:
            around = level[-1]
            level = around.inner
        level.append(region)
    return outermost, cut


def mapped(text, of_line):
    return "\n".join(map(of_line, text.split("\n")))


def switched(text, faults):
    """The text of a file with all these faults, (number, fault), behind switches, line by line where it was; and the numbers of those left out."""
    code, plain = (mapped(text, of_line) for of_line in (code_of, without_comments))
    outermost, cut = regions_of(text, code, faults)

    def render(begin, end, inner):
        out, at = "", begin
        for region in inner:
            out += text[at:region.begin]
            for place, fault, number in region.faults:
                faulty = plain[region.begin:place] + fault.new + plain[place + len(fault.old):region.end]
                out += f"(planted::fault({number}) ? ({' '.join(faulty.split())}) : "
            out += "(" + render(region.begin, region.end, region.inner) + ")" + ")" * len(region.faults)
            at = region.end
        return out + text[at:end]
    return render(0, len(text), outermost), cut


def lines_of(text, faults):
    """For the number of each fault the lines, counted from 1, that its switch stands in."""
    waiting, lines = regions_of(text, mapped(text, code_of), faults)[0], {}
    while waiting:
        region = waiting.pop()
        waiting += region.inner
        span = range(text.count("\n", 0, region.begin) + 1, text.count("\n", 0, region.end) + 2)
        lines |= {number: span for _, _, number in region.faults}
    return lines

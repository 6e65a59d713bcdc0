"""What the compiler says of the commonest mistakes in a part: mistakes.py ROOT BUILD FOLDER.

Each mistake is a change of what `perikit new` writes. The first line with `error:` must be the message that framework/docs/scalars.md prints for it, and the
unchanged templates must compile. Two mistakes show only when the library is built: of these the message of perikit-manifest is compared.
"""

import concurrent.futures
import json
import pathlib
import re
import subprocess
import sys

ROOT, BUILD, FOLDER = map(pathlib.Path, sys.argv[1:])
PSI = "  template <class T, class S, class K>\n  T psi(const Tensor<T, S>& H, const K& k) const noexcept {"
J = "const T j = jacobian_minus_one(H),"

# What stands in the page -> kind of the template, text, and what an author writes in its place.
MISTAKES = {
    "if (j < 0.0)": ("material", J, "if (jacobian_minus_one(H) < 0.0) return T(0.0);\n    " + J),
    "j < 0.0 ? a : b": ("material", J, "const T a = jacobian_minus_one(H) < 0.0 ? T(1.0) : T(2.0);\n    " + J),
    "std::sqrt(J)": ("material", J, "const T root = std::sqrt(T(1.0 + jacobian_minus_one(H)));\n    " + J),
    "std::max(j, 0.0)": ("material", J, "const T growth = std::max(jacobian_minus_one(H), 0.0);\n    " + J),
    "double psi(...)": ("material", "  T psi(", "  double psi("),
    "psi without const": ("material", "const K& k) const noexcept {", "const K& k) noexcept {"),
    "psi for packs alone": ("material", PSI, "  template <class S, class K>\n  Pack psi(const Tensor<Pack, S>& H, const K& k) const noexcept {\n    using T = Pack;"),
    "psi for one scalar and one space": ("material", PSI, "  double psi(const Tensor<double, Solid>& H, const std::array<double, 3>& k) const noexcept {\n    using T = double;"),
    "neither psi nor P": ("material", "  T psi(", "  T energy("),
    "P without psi": ("material", "  T psi(const Tensor<T, S>& H", "  Tensor<T, S> P(const Tensor<T, S>& H"),
    "a law registered without LawMaterial": ("material", "std::make_unique<LawMaterial<PartName>>()", "std::make_unique<PartName>()"),
    "an influence function without const": ("influence", "std::span<double> omega) const override {", "std::span<double> omega) {"),
    "a stabilization without penalty": ("stabilization", "void penalty(const PenaltyPoint& x, double* M) const noexcept override", "void stiffness(const PenaltyPoint& x, double* M) const noexcept"),
    "a kinematics with other arguments": ("kinematics", "double* g, std::size_t stride) const noexcept override", "double* g, int stride) const noexcept"),
    "a criterion without const": ("damage", "void integrity(const IntegrityBatch& b) const noexcept override", "void integrity(const IntegrityBatch& b)"),
    "a term registered without LawTerm": ("term", "std::make_unique<LawTerm<PartName>>()", "std::make_unique<PartName>()"),
    "an energy of a term without const": ("term", "const K& k) const noexcept {", "const K& k) noexcept {"),
    "a parameter without a unit": ("influence", 'table.number("width", "-", ', 'table.number("width", '),
    "a function that takes the values alone": ("influence", "[](const ParameterValues& values, const PartFactory&)", "[](const ParameterValues& values)"),
}


def flags():
    """Those of a part, without what belongs to its own file."""
    commands = json.loads((BUILD / "compile_commands.json").read_text())
    words = next(c["command"] for c in commands if c["file"].endswith("materials/neo_hookean/plugin.cpp")).split()
    compiler = next(w for w in words if re.search(r"(\+\+|cc|clang)[-0-9.]*$", w) and "ccache" not in w)
    kept = [w for w in words if re.match(r"-(D|I|m|f|std|W)", w) and "_EXPORTS" not in w and not w.startswith("-Winvalid-pch")]
    return [compiler, *kept, "-w"]


def first_error(text):
    lines = [line for line in text.splitlines() if re.search(r"\berror:", line)]
    return re.sub(r"^.*?error: (static assertion failed(?: due to requirement '.*?')?: )?", "", lines[0]) if lines else ""


def compile_part(command, name, text):
    file = FOLDER / f"{re.sub(r'[^a-z]+', '_', name.lower())}.cpp"
    file.write_text('#include "parts.hpp"\n' + text)
    return first_error(subprocess.run([*command, f"-I{FOLDER}", "-fsyntax-only", "-fmax-errors=1", str(file)], capture_output=True, text=True).stderr)


def messages_of_page():
    page = (ROOT / "framework/docs/scalars.md").read_text()
    rows = re.findall(r"^\| (.*?) \| `` (.*?) `` \|$", page, re.MULTILINE)
    return {what.replace("`", ""): message.replace("\\|", "|") for what, message in rows}


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    command, expected = flags(), messages_of_page()
    templates = {kind: (ROOT / f"framework/templates/{kind}/plugin.cpp").read_text() for kind in ("material", "influence", "stabilization", "kinematics", "damage", "term", "integrator")}
    # What all of them read is read once.
    includes = sorted({line for text in templates.values() for line in re.findall(r"^#include.*", text, re.MULTILINE)})
    (FOLDER / "parts.hpp").write_text("\n".join(includes) + "\n")
    subprocess.run([*command, "-x", "c++-header", str(FOLDER / "parts.hpp"), "-o", str(FOLDER / "parts.hpp.gch")], check=True)

    wrong = []
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        final = templates["material"].replace("struct PartName {", "struct PartName final {")
        assert final != templates["material"]
        sound = {kind: pool.submit(compile_part, command, f"sound {kind}", text) for kind, text in (templates | {"final law": final}).items()}
        found = {}
        for name, (kind, text, instead) in MISTAKES.items():
            assert templates[kind].count(text) == 1, f"{name}: '{text}' stands {templates[kind].count(text)} times in the template"
            found[name] = pool.submit(compile_part, command, name, templates[kind].replace(text, instead))
        wrong += [f"the template ({kind}) does not compile: {job.result()}" for kind, job in sound.items() if job.result()]
        found = {name: job.result() for name, job in found.items()}

    # A library without PERIKIT_PLUGIN.
    (FOLDER / "no_plugin.cpp").write_text("int nothing;\n")
    library = FOLDER / "no_plugin.so"
    subprocess.run([command[0], "-shared", "-fPIC", str(FOLDER / "no_plugin.cpp"), "-o", str(library)], check=True)
    said = subprocess.run([str(BUILD / "bin/perikit-manifest"), str(library)], capture_output=True, text=True)
    found["a library without PERIKIT_PLUGIN"] = said.stderr.strip().removeprefix(f"{library}: this library is refused: ")

    for name, message in found.items():
        print(f"{name}: {message}")
        if expected.get(name) != message:
            wrong.append(f"{name}: the compiler says\n    {message}\n  framework/docs/scalars.md\n    {expected.get(name)}")
    wrong += [f"{name}: stands in framework/docs/scalars.md and is not tried" for name in expected if name not in found]
    sys.exit("\n".join(wrong) if wrong else 0)


main()

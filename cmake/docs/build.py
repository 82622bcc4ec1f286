#!/usr/bin/env python3
"""cmake/docs/build.py [--output FOLDER] [--only FOLDER_OF_FIRN]: builds the reference and the guide with Doxygen, into
build/docs/html by default, and fails where something is wrong: a public name without a sentence, a command that Doxygen
does not understand, a link that leads nowhere. What Doxygen says falsely is listed in false_warnings.txt. With --only
just the warnings of one of firn's folders (or headers) count.

A public name is what is declared in namespace firn or below it, outside of a namespace `detail`.
"""
import argparse
import html.parser
import re
import shutil
import subprocess
import sys
import textwrap
import urllib.parse
from pathlib import Path

docs = Path(__file__).resolve().parent
root = docs.parent.parent
theme = Path("/usr/share/doxygen-awesome-css")

# Members that policies and records have by agreement, and what they are. A header need not say it again.
agreed = [
    (r"static constexpr const char\* name\b", "The name in states, programs for a GPU and messages."),
    (r"static constexpr (auto|std::tuple<>) parameters\(\)", "The parameters, each with its name, unit and member."),
    (r"static constexpr auto fields\(\)", "The fields of a particle's state, each with its name, unit and member."),
    (r"static constexpr int dimension\b", "The number of dimensions of space: 2 or 3."),
    (r"using scalar_type =", "The type of the numbers it computes with."),
    (r"(friend )?(constexpr )?bool operator==\(const \w+&(, const \w+&)?\) (const )?= default;", "Equal in all members."),
]
agreed = [(re.compile(r"( *)(\[\[\w+\]\] )?(" + pattern + ")"), sentence) for pattern, sentence in agreed]

# The folders of firn, in the order in which a reader meets them.
rooms = {
    "simulation": ("Simulation", "A domain, materials and policies, and the steps that move particles."),
    "material": ("Materials", "The stress that a deformation causes: elastic solids, sand, snow, fluids, and yours."),
    "boundary": ("Boundaries", "Walls, moving solids and meshes, and how matter meets their surface."),
    "kernel": ("Kernels", "The weights with which a particle reaches the nodes around it."),
    "transfer": ("Transfers", "What particles give to nodes and take back: PIC, APIC, FLIP and their kin."),
    "force": ("Force forms", "How a particle's stress becomes forces on nodes."),
    "field": ("Acceleration fields", "Gravity, attraction, damping."),
    "lagrangian": ("Particles, soft bodies and cloth", "Points, nets of springs, constraints and collisions, without a "
                   "grid or on it."),
    "io": ("States and files", "States in HDF5, restart, OBJ and PLY."),
    "data": ("Particles, grids and shapes", "Particles and grids in memory; meshes, and shapes filled with particles."),
    "core": ("Vectors, errors, threads", "What all else is made of: numbers, vectors, SIMD lanes, errors, threads."),
    "math": ("Mathematics", "Functions of numbers, lanes and small matrices."),
    "stage": ("Stages: formulas", "P2G, grid update and G2P of one particle or node, for any scalar."),
    "loops": ("Stages: loops", "P2G, grid update and G2P over all particles and nodes, on all threads."),
    "wgsl": ("Programs for a GPU", "From policies to a complete WGSL program and what a host needs to run it."),
    "webgpu": ("Running on a GPU", "WGSL programs of firn, run through WebGPU's C interface."),
    "sort": ("Engine room: sorting", "Finds blocks of particles, their order, and what may be scattered side by side."),
    "simd": ("Engine room: SIMD lanes", "Rows of nodes in registers."),
}


def prepared(text, room):
    """The header as Doxygen is to see it: the comment of the file under \\file, agreed members with their sentences, and
    what is in a public namespace in the group of its folder."""
    text = text.replace("namespace firn::inline FIRN_BUILD", "namespace firn")  # which programs need not know
    match = re.search(r"^/// \\file ", text, re.M)
    if match:
        text = text[: match.start()] + "/// " + text[match.end():]
    text = text.replace("#pragma once", "/// \\file\n#pragma once", 1)
    lines = []
    for line in text.split("\n"):
        if not (lines and lines[-1].lstrip().startswith("///")) and "///<" not in line:
            for pattern, sentence in agreed:
                found = pattern.match(line)
                if found:
                    lines.append(f"{found.group(1)}/// {sentence}")
                    break
        public = re.match(r"(})?(  // )?namespace firn(?!.*detail)", line)
        if public and public[1]:
            lines += ["/// @}", ""]
        lines.append(line)
        if public and not public[1]:
            lines += ["", f"/// \\addtogroup {room}", "/// @{", ""]
    return "\n".join(lines)


def fenced(text, language):
    """Code as a block of its own, without the indentation that all of its lines share."""
    return f"```{language}\n{textwrap.dedent(text).strip(chr(10))}\n```\n" if text.strip() else ""


def woven(program):
    """The page of a program: its comments that begin with //! are the text, all else is code."""
    parts, code = [], []
    for line in program.read_text().split("\n"):
        found = re.match(r" *//!(?: (.*))?$", line)
        if not found:
            code.append(line)
            continue
        if code:
            parts.append("\n" + fenced("\n".join(code), "cpp") + "\n")
            code = []
        parts.append((found.group(1) or "") + "\n")
    return "".join(parts) + "\n" + fenced("\n".join(code), "cpp")


def page_name(path):
    return "guide_" + re.sub(r"^\d+_", "", path.stem)


def guide_pages():
    return sorted(path for path in (root / "examples/guide").glob("[0-9][0-9]_*") if path.suffix in (".cpp", ".md"))


def example_sources():
    return sorted(path for path in (root / "examples").glob("*") if path.suffix in (".cpp", ".hpp", ".py"))


def with_links_to_examples(text):
    """`examples/NAME`, with or without what follows the dot, becomes a link to the page of that program."""
    names = {path.stem: path for path in example_sources()}
    return re.sub(r"`examples/(\w+)(?:\.\w+)?`",
                  lambda found: f'@ref example_{found[1]} "{names[found[1]].name}"' if found[1] in names else found[0], text)


def prepare_examples(source):
    """A page for each program of examples/, which shows it."""
    language = {".cpp": "cpp", ".hpp": "cpp", ".py": "py"}
    contents = ""
    for path in example_sources():
        text = path.read_text()
        words = []
        for line in text.split("\n")[:20]:
            found = re.match(r"/// (?:\\file )?(.*)", line) or (path.suffix == ".py" and re.match(r'"""(.*?)(?:""")?$', line))
            if found:
                words.append(found[1])
            elif words:
                break
        words = " ".join(words).replace("<", "\\<").replace("@", "\\@")
        contents += f"- @subpage example_{path.stem}\n"
        (source / f"example_{path.stem}.md").write_text(
            f"# {path.name} {{#example_{path.stem}}}\n\n{words}\n\n{fenced(text, language[path.suffix])}")
    (source / "2_examples.md").write_text("# Examples {#examples}\n\nEach of these programs has `--help`, unless it has no "
                                        f"options. `examples/run.sh --all` builds them all.\n\n{contents}")


def page(path, link="@ref"):
    """A page in Doxygen's Markdown, from a program or a text. A line that only links to a program shows the program."""
    text = woven(path) if path.suffix == ".cpp" else path.read_text()
    text = with_links_to_examples(text)
    text = re.sub(r"!\[(.*)\]\(\S*?([^/\s]+\.(?:png|webp))\)", r"![\1](\2)", text)  # a picture by its name alone
    of_guide = "|".join(re.escape(each.name) for each in guide_pages())
    text = re.sub(rf"\[([^\]]*)\]\(\S*?({of_guide})\)", lambda found: f'{link} {page_name(Path(found[2]))} "{found[1]}"',
                  text)
    return re.sub(r"^\[[^\]]*\]\((\S+[ch]pp)\)$", lambda found: fenced((path.parent / found[1]).read_text(), "cpp"), text,
                  flags=re.M)


def prepare_guide(source):
    for path in guide_pages():
        title, text = page(path).lstrip("\n").split("\n", 1)
        (source / f"{page_name(path)}.md").write_text(f"{title} {{#{page_name(path)}}}\n{text}")
    title, text = page(root / "examples/guide/README.md", "@subpage").split("\n", 1)
    (source / "1_guide.md").write_text(f"{title} {{#guide}}\n{text}")


def prepare_front(source):
    """The first page: what the README shows first, and what there is to read."""
    first = page(root / "README.md").split("\n## ", 1)[0]
    pages = "".join(f"- @ref {page_name(path)}\n" for path in guide_pages())
    folders = "".join(f"- @ref {room} \"{title}\": {about}\n" for room, (title, about) in rooms.items())
    (source / "front.md").write_text(f"{first}\n\n## Guide\n\nEach page of the @ref guide \"guide\" is a program:\n\n{pages}"
                                     f"\n## Reference\n\n{folders}\nSearch finds any name, without a network.\n")


def prepare(output):
    source = output / "input"
    shutil.rmtree(source, ignore_errors=True)
    for header in sorted((root / "include/firn").rglob("*.hpp")):
        path = header.relative_to(root / "include")
        if "vendor" in path.parts:
            continue
        room = path.parts[1] if len(path.parts) > 2 else "simulation"
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        (source / path).write_text(prepared(header.read_text(), room))
    groups = "".join(f"/// \\defgroup {room} {title}\n/// {about}\n\n" for room, (title, about) in rooms.items())
    (source / "rooms.dox").write_text(groups)
    prepare_examples(source)
    prepare_guide(source)
    prepare_front(source)
    return source


def layout(file):
    """Doxygen's own order of things, but for a class what it is before the list of its members, and for a group its
    concepts after its classes and functions."""
    subprocess.run(["doxygen", "-l", file], check=True)
    text = file.read_text()

    def moved(text, part, line, before):
        """In a part of the layout, the line comes before another."""
        start, end = text.index(f"<{part}>"), text.index(f"</{part}>")
        inside = text[start:end].replace(line, "").replace(before, f"{line}\n    {before}", 1)
        return text[:start] + inside + text[end:]

    text = moved(text, "class", '<detaileddescription title=""/>', "<memberdecl>")
    text = moved(text, "group", '<concepts visible="yes" title=""/>', '<membergroups visible="yes"/>')
    text = text.replace('<briefdescription visible="yes"/>', '<briefdescription visible="no"/>', 1)  # of a class
    text = text.replace('<tab type="modules" visible="yes" title=""', '<tab type="modules" visible="yes" title="Reference"')
    file.write_text(text)


def version():
    text = (root / "include/firn/version.hpp").read_text()
    return ".".join(re.search(rf"_{part} (\d+)", text).group(1) for part in ("MAJOR", "MINOR", "PATCH"))


def warnings(log, source):
    """What Doxygen complains of and is not known to be false, with paths of firn's headers."""
    false = [line for line in (docs / "false_warnings.txt").read_text().split("\n") if line and line[0] != "#"]
    told, unused = [], set(false)
    for line in log.read_text().split("\n"):
        line = line.replace(f"{source}/", "")
        if "warning:" not in line and "error:" not in line:
            continue
        known = [text for text in false if text in line]
        unused.difference_update(known)
        if not known:
            told.append(line)
    return sorted(set(told)), sorted(unused)


def undocumented_concepts(site, source):
    """Doxygen tells of no concept without a sentence, but links to a page that it does not write."""
    told = []
    for link in Links(site / "concepts.html").links:
        if not link.startswith("concept") or (site / link).exists():
            continue
        name = link.removeprefix("concept").removesuffix(".html").split("_1_1")[-1].replace("__", "_")
        for header in sorted(source.rglob("*.hpp")):
            for number, line in enumerate(header.read_text().split("\n"), 1):
                if re.match(rf"\s*concept {name} =", line):
                    told.append(f"{header.relative_to(source)}:{number}: warning: concept {name} is not documented.")
    return told


def without_false_links(site):
    """Takes out links that Doxygen makes without reason: at the head of a page to a section of it that is left out, as all
    in it is hidden; in a program from a name that means something else there."""
    for path in site.rglob("*.html"):
        text = path.read_text()
        links = re.findall(r'(<a href="#([\w-]+)">[^<]*</a>(?: &#124;\s*)?)', text)
        for link, place in links:
            if f'name="{place}"' not in text and f'id="{place}"' not in text:
                text = text.replace(link, "")
        # A function of the standard library is no link to firn's of the same name.
        text = re.sub(r"(std::)<a [^>]*>(\w+)</a>|<a [^>]*>(std::\w+)</a>",
                      lambda found: found[3] or found[1] + found[2], text)
        # Of several overloads Doxygen takes any; of variables of a program it knows nothing.
        text = re.sub(r'<a class="code[^>]*>((?:firn::)?(?:state_of|restore|totals|name))</a>', r"\1", text)
        path.write_text(text)


def broken_tables(site):
    """A table that Doxygen does not take for one stays in the text with its bars."""
    return [f"{path.name}: a table is not taken for one: {line.strip()[:80]}" for path in sorted(site.rglob("*.html"))
            for line in path.read_text().split("\n") if re.match(r"<p>\s*\|", line)]


class Links(html.parser.HTMLParser):
    """The links of a page, and the places in it that can be linked to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.places = [], {""}
        self.feed(path.read_text(errors="replace"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if value and (name in ("href", "src") and tag in ("a", "img", "link", "script", "iframe")):
                self.links.append(value)
            if value and (name == "id" or (name == "name" and tag == "a")):
                self.places.add(value)


def dead_links(site):
    """The links of the site to its own pages that lead nowhere; and how many links there are."""
    pages = {path: Links(path) for path in site.rglob("*.html")}
    dead, count = [], 0
    for path, page_of_site in pages.items():
        for link in page_of_site.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            count += 1
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                dead.append(f"{path.name}: {link}: no such file")
            elif target in pages and urllib.parse.unquote(parts.fragment) not in pages[target].places:
                dead.append(f"{path.name}: {link}: no such place in the page")
    return sorted(set(dead)), count


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=root / "build/docs")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    if not shutil.which("doxygen"):
        print("skipped: the site, which needs Doxygen (Debian, Ubuntu: doxygen, doxygen-awesome-css)")
        return 77
    output = options.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    source = prepare(output)
    shutil.rmtree(output / "html", ignore_errors=True)
    text = (docs / "Doxyfile.in").read_text()
    sheets = [theme / "doxygen-awesome.css", theme / "doxygen-awesome-sidebar-only.css"] if theme.exists() else []
    if not sheets:
        print(f"{theme} is not here (Debian, Ubuntu: doxygen-awesome-css); the site has Doxygen's own looks")
    for name, value in {"INPUT": source, "OUTPUT": output, "ROOT": root, "VERSION": version(),
                        "SHEETS": " ".join(f'"{sheet}"' for sheet in [*sheets, docs / "style.css"])}.items():
        text = text.replace(f"@{name}@", str(value))
    (output / "Doxyfile").write_text(text)
    layout(output / "layout.xml")
    subprocess.run(["doxygen", output / "Doxyfile"], check=True)
    told, unused = warnings(output / "warnings.txt", source)
    told = sorted(told + undocumented_concepts(output / "html", source))
    without_false_links(output / "html")
    dead, links = dead_links(output / "html")
    if options.only:
        told, dead, unused = [line for line in told if line.startswith(f"firn/{options.only}")], [], []
    else:
        told += broken_tables(output / "html")
    for line in told + dead + [f"false_warnings.txt: no longer told, take it out: {line}" for line in unused]:
        print(line)
    print(f"{len(told)} warnings, {links} links, {len(dead)} of them dead: {output / 'html/index.html'}")
    return 1 if told or dead or unused else 0


if __name__ == "__main__":
    sys.exit(main())

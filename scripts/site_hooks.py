"""Of mkdocs.yml: the files beside docs/ that its pages link to become pages, too, and formulas are drawn by Debian's KaTeX."""
import posixpath
import re
from pathlib import Path

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parent.parent
KATEX = Path("/usr/share/javascript/katex")
# Of the repository: where it is on the site.
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "SECURITY.md": "SECURITY.md",
         "CHANGELOG.md": "CHANGELOG.md"}
RENDER = """document.addEventListener('DOMContentLoaded', () => renderMathInElement(document.body,
  {delimiters: [{left: '\\\\(', right: '\\\\)', display: false}, {left: '\\\\[', right: '\\\\]', display: true}]}));
"""
LINK = re.compile(r"(!?\[[^\]]*\]\()([^)#\s]+)((?:#[^)]*)?\))")


def place_of(path):
    """Where a file of the repository is on the site; those beside docs/ are copied by on_files()."""
    return PAGES.get(path, path.removeprefix("docs/"))


def rewritten(text, source, target):
    """The links of a file `source` of the repository as they are on the page `target` of the site."""
    def link(match):
        before, address, after = match.groups()
        if ":" in address:
            return match[0]
        path = posixpath.normpath(posixpath.join(posixpath.dirname(source), address))
        if path.startswith("..") or not (ROOT / path).exists():
            raise PluginError(f"{source}: the link to '{address}' leads to nothing in the repository")
        if (ROOT / path).is_dir() or path.endswith(".ipynb"):  # they have no page
            return re.sub(r"^!?\[|\]\($", "", before)
        return before + posixpath.relpath(place_of(path), posixpath.dirname(target) or ".") + after
    return LINK.sub(link, text)


def linked_files():
    """Files beside docs/ that pages link to, such as the source of an example."""
    found = set()
    for document in [*(ROOT / page for page in PAGES), *sorted((ROOT / "docs").rglob("*.md"))]:
        source = document.relative_to(ROOT).as_posix()
        for match in LINK.finditer(document.read_text(encoding="utf-8")):
            path = posixpath.normpath(posixpath.join(posixpath.dirname(source), match[2]))
            if ":" not in match[2] and not path.startswith("docs/") and path not in PAGES and (ROOT / path).is_file():
                found.add(path)
    return found


def on_files(files, config):
    for source, target in PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, target, content=rewritten(text, source, target)))
    for path in sorted(linked_files()):
        files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
    for name in ("katex.min.css", "katex.min.js", "contrib/auto-render.js"):
        files.append(File.generated(config, f"katex/{name}", abs_src_path=str(KATEX / name)))
    for font in sorted((KATEX / "fonts").glob("*.*")):
        files.append(File.generated(config, f"katex/fonts/{font.name}", abs_src_path=str(font)))
    files.append(File.generated(config, "katex/render.js", content=RENDER))
    return files


def on_page_markdown(markdown, page, config, files):
    source = page.file.src_uri
    return markdown if source in PAGES.values() else rewritten(markdown, f"docs/{source}", source)

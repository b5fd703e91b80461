#!/usr/bin/env python3
"""Finish the site that Doxygen wrote: check its links, make the index of its search, remove what no page uses.

    site_finish.py HTML     HTML: build/doc/html; exit code 1 and a line for each dead link

From index.html on, every link and picture of every page must lead to a file of the site, and every anchor to an id there;
addresses of other machines are counted, not opened. Files that cannot be reached are Doxygen's left-overs and are removed.
search.js gets one entry for each section of a page and each public name: [address, page, heading, text].
"""
import collections
import html.parser
import json
import pathlib
import re
import sys
import urllib.parse

SKIP = {"script", "style", "nav", "header", "footer", "button"}  # their words are no text of the page
EMPTY = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "wbr"}


# What Doxygen writes, and what the site has instead.
MEND = [
    (r'<p ?><a class="anchor" id="md_[^"]*"></a></p>|<a class="anchor" id="md_[^"]*"></a>', ""),  # named after a path of this machine
    (r'<div id="nav-path".*?</ul>\s*</div>', ""),
    (r" (?:File|Struct|Union) Reference(?=</)", ""),
    (r'<object type="image/svg\+xml" data="([^"]*)"[^>]*>([^<]*)</object>', r'<img src="\1" alt="\2">'),
    (r"href=\"(\w+)_8md\.html", lambda found: f'href="{found.group(1).replace("__", "_")}.html'),  # words such as "banet.md"
]


class Page(html.parser.HTMLParser):
    """Ids, links and sections of a page."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.ids, self.links, self.title = set(), [], ""
        self.sections = [["", "", []]]  # id, heading, words
        self.stack, self.last_id, self.in_heading = [], "", False
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        for key in ("id", "name"):
            if attrs.get(key):
                self.ids.add(attrs[key])
                if self.in_heading:  # a page has its anchor inside the heading, a header before it
                    self.sections[-1][0] = attrs[key]
                self.last_id = attrs[key]
        self.links += [attrs[key] for key in ("href", "src", "data") if attrs.get(key) and tag not in ("base",)]
        is_member = tag == "h2" and attrs.get("class") == "memtitle"
        if tag in ("h1", "h2", "h3") and not self.skipped() and (is_member or not attrs.get("class")):
            self.sections.append([self.last_id, "", []])
            self.in_heading = True
        if tag not in EMPTY:
            self.stack.append(tag)

    def handle_endtag(self, tag):
        while self.stack and tag in self.stack and self.stack.pop() != tag:
            pass
        if tag in ("h1", "h2", "h3"):
            self.in_heading = False

    def skipped(self):
        return any(tag in SKIP for tag in self.stack)

    def handle_data(self, data):
        if self.stack and self.stack[-1] == "title":
            self.title = data.strip()
        elif not self.skipped() and data.strip():
            if self.in_heading:
                self.sections[-1][1] += data.replace("\u25c6\u00a0", "").replace("\n", " ")
                self.in_heading = "h1" in self.stack or "h2" in self.stack or "h3" in self.stack
            else:
                self.sections[-1][2].append(data)


def crawl(folder):
    """Every page and file that index.html leads to, with the dead links."""
    pages, files, wanted, errors, far = {}, set(), collections.deque(["index.html"]), [], set()
    asked = {}  # page -> anchors, with the page that asks
    while wanted:
        name = wanted.popleft()
        if name in pages:
            continue
        pages[name] = Page((folder / name).read_text(encoding="utf-8"))
        for link in pages[name].links:
            address = urllib.parse.urlsplit(link)
            if address.scheme or address.netloc:
                far.add(link)
                continue
            target = urllib.parse.unquote(address.path) or name
            if not (folder / target).is_file():
                errors.append(f"{name}: the link to {link} leads nowhere")
                continue
            if target.endswith(".html"):
                wanted.append(target)
                if address.fragment:
                    asked.setdefault(target, []).append((urllib.parse.unquote(address.fragment), name))
            else:
                files.add(target)
    for target, anchors in asked.items():
        for anchor, name in anchors:
            if anchor not in pages[target].ids:
                errors.append(f"{name}: {target} has no place {anchor}")
    return pages, files, sorted(set(errors)), far


def index(pages):
    """Entries of the search: sections of pages, public names of headers and structs."""
    entries = []
    for name, page in sorted(pages.items()):
        if re.search(r"_source\.html$|^dir_|^globals|^functions|^annotated|^classes", name):
            continue
        title = re.sub(r"^omentum: ", "", page.title)
        for place, heading, words in page.sections:
            text = " ".join(" ".join(words).split())
            heading = " ".join(heading.split())
            if text or heading:
                entries.append([name + (f"#{place}" if place and heading else ""), title, heading, text])
    return entries


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    for path in folder.glob("*.html"):
        text = path.read_text(encoding="utf-8")
        for pattern, instead in MEND:
            text = re.sub(pattern, instead, text, flags=re.S)
        path.write_text(text, encoding="utf-8")
    pages, files, errors, far = crawl(folder)
    for path in folder.iterdir():
        if path.name not in pages and path.name not in files and path.name != ".omentum":
            path.unlink()
    entries = index(pages)
    (folder / "search.js").write_text("siteIndex=" + json.dumps(entries, ensure_ascii=False, separators=(",", ":")) + ";\n", encoding="utf-8")
    print("\n".join(errors + [f"{len(pages)} pages, {len(files)} other files, {len(entries)} places in the search, {len(errors)} dead links; "
                              f"{len(far)} addresses outside the site were not opened"]))
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()

"""Finds the links and headings of markdown files as GitHub and the site read them."""
import re


def without_code(text):
    """Returns the text with code blocks and code spans blanked, so that brackets in code are no links."""
    text = re.sub(r"(?ms)^(\s*)(```+|~~~+).*?^\s*\2\s*?$", "", text)
    return re.sub(r"(`+)(?!`).+?(?<!`)\1(?!`)", lambda m: "`" if "](" not in m[0] else "", text, flags=re.S)


def links_of(text):
    """Returns the targets of a page's links and pictures, written [text](target) or [name]: target."""
    plain = without_code(text)
    found = re.findall(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)", plain)
    return found + re.findall(r"(?m)^\[[^\]]+\]:\s*(\S+)", plain)


def anchors_of(text):
    """Returns the anchors of headings by GitHub's rule; a repeated one gets -1, -2."""
    seen, anchors = {}, set()
    plain = re.sub(r"(?ms)^(\s*)(```+|~~~+).*?^\s*\2\s*?$", "", text)
    for heading in re.findall(r"(?m)^#{1,6}\s+(.+?)\s*#*\s*$", plain):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        count = seen.get(anchor, 0)
        seen[anchor] = count + 1
        anchors.add(f"{anchor}-{count}" if count else anchor)
    return anchors | set(re.findall(r'<a (?:id|name)="([^"]+)"', text))

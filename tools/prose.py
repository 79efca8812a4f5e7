#!/usr/bin/env python3
"""Counts signs of prose that a reader cannot understand on its own, in the comments of Rust files and in Markdown.

    python3 tools/prose.py                 every sign of the tree against the ceilings in tools/prose_ceilings.json
    python3 tools/prose.py --lower         writes the counts as new ceilings; a ceiling never rises
    python3 tools/prose.py FILE ..         the signs of these files, line by line

Signs of comments, per 1,000 comment lines:
  opens   a doc comment that opens with a word that points elsewhere ("The same ..", "What ..", "Those ..", "It ..")
  points  a comment of under 90 letters with two or more words that point ("it", "that", "those", "there", "so", "such", "which")
  long    a sentence of more than 30 words
Signs of both, as a number of lines or sentences:
  wide    a comment or a line of Markdown of more than 120 columns; tables, links and images aside
  long_md a sentence of more than 30 words in Markdown

A sign is a place to look at, not a verdict. The exit code is 1 if a sign is above its ceiling, or below it by more than a tenth, so that
the ceiling follows the prose down.
"""

import json
import pathlib
import re
import subprocess
import sys

CEILINGS = pathlib.Path(__file__).with_name("prose_ceilings.json")
OPENING = re.compile(
    r"^(the same|what|those|these|that|it|its|they|where|how|of (it|them|which|those)|beyond|so|such|as (it|they|the)|whether"
    r"|from (it|where|there)|the other|this is)\b",
    re.IGNORECASE,
)
POINTING = re.compile(
    r"\b(it|its|they|them|their|that|those|these|there|this|so|such|what|which|whose|else|elsewhere|otherwise|here)\b",
    re.IGNORECASE,
)
COMMENT = re.compile(r"^\s*(///|//!|//)\s?(.*)$")
NOT_PROSE = re.compile(r"`[^`]*`|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|\|[^|]*\|")
WIDEST = 120
LONGEST = 30


def paragraphs(text, markdown):
    """Yields (first line, text, is a doc comment) of each comment block or paragraph, code blocks left out."""
    kept, start, kind, fenced = [], 0, False, False
    for number, line in enumerate([*text.splitlines(), ""], 1):
        match = None if markdown else COMMENT.match(line)
        is_doc = bool(match) and match.group(1) != "//"
        body = (line.strip() or None) if markdown else match.group(2) if match else None
        if body is not None and body.lstrip().startswith("```"):
            fenced, body = not fenced, None
        elif fenced and (markdown or match):
            body = None
        elif not markdown and not match:
            fenced = False
        if markdown and body is not None and line.startswith(("#", "    ")) or (body or "").startswith("|"):
            body = None
        if kept and (body is None or is_doc != kind):
            yield start, " ".join(kept), kind
            kept = []
        if body is not None:
            if not kept:
                start, kind = number, is_doc
            kept.append(body)


def signs(path, text):
    """Yields (line, sign, excerpt)."""
    markdown = path.endswith(".md")
    for start, prose, is_doc in paragraphs(text, markdown):
        plain = NOT_PROSE.sub("x", prose)
        if is_doc and OPENING.match(plain):
            yield start, "opens", prose[:110]
        if not markdown and len(plain) < 90 and len(POINTING.findall(plain)) >= 2:
            yield start, "points", prose[:110]
        for sentence in re.split(r"(?<=[.;:?!])\s+", plain):
            if len(sentence.split()) > LONGEST:
                yield start, "long_md" if markdown else "long", f"{len(sentence.split())} words: {sentence[:90]}"
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= markdown and line.lstrip().startswith("```")
        prose = not fenced and not line.startswith(("|", "!", "[", "    ")) if markdown else COMMENT.match(line)
        if prose and len(line) > WIDEST:
            yield number, "wide", f"{len(line)} columns"


def of_tree():
    """Counts of all signs, those of comments per 1,000 lines."""
    listed = subprocess.run(["git", "ls-files", "*.rs", "*.md"], capture_output=True, text=True, check=True)
    counts, comments = dict.fromkeys(["opens", "points", "long", "wide", "long_md"], 0), 0
    for path in listed.stdout.split():
        text = pathlib.Path(path).read_text(encoding="utf-8")
        comments += 0 if path.endswith(".md") else sum(1 for line in text.splitlines() if COMMENT.match(line))
        for _, sign, _ in signs(path, text):
            counts[sign] += 1
    if not comments:
        sys.exit("no comments were found: run this from the root of the repository")
    return {sign: round(1000 * n / comments, 1) if sign in ("opens", "points", "long") else n for sign, n in counts.items()}


def main(arguments):
    if arguments and arguments != ["--lower"]:
        for path in arguments:
            for number, sign, excerpt in signs(path, pathlib.Path(path).read_text(encoding="utf-8")):
                print(f"{path}:{number}: {sign}: {excerpt}")
        return
    ceilings, counts = json.loads(CEILINGS.read_text()), of_tree()
    if arguments:
        CEILINGS.write_text(json.dumps({sign: min(n, ceilings[sign]) for sign, n in counts.items()}, indent=4) + "\n")
        return
    wrong = False
    for sign, count in counts.items():
        ceiling = ceilings[sign]
        remark = ""
        if count > ceiling:
            remark = "above the ceiling: `python3 tools/prose.py FILE` shows each place"
        elif count < 0.9 * ceiling - 1:
            remark = "far below the ceiling: lower it with `python3 tools/prose.py --lower`"
        wrong |= bool(remark)
        print(f"{sign:8} {count:7} of {ceiling:7} {remark}")
    sys.exit(wrong)


main(sys.argv[1:])

"""The committed script of the pages is built from its sources and contains the licences of its
libraries.
"""

import hashlib
import re
from importlib.resources import files

PAGE = files("cosim.report") / "page"


def test_the_bundle_is_made_from_its_sources():
    sources = sorted((PAGE / "src").iterdir(), key=lambda path: path.name)
    digest = hashlib.sha256(
        b"".join(path.read_bytes() for path in (PAGE / "package.json", *sources))
    ).hexdigest()
    made_from = re.match(
        r"/\* made from sources (\w+)", (PAGE / "bundle/replay.js").read_text()
    ).group(1)
    assert made_from == digest, "run `npm install && npm run build` in cosim/report/page"


def test_licences_are_inside():
    text = (PAGE / "bundle/replay.js").read_text()
    for owner in ("three.js authors", "Leon Sorokin"):
        assert re.search(rf"Copyright .*{owner}", text)
    assert text.count("Permission is hereby granted, free of charge") == 2

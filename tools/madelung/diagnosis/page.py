"""HTML pages that need no other file and no network: templates, and scripts packed into them."""

from __future__ import annotations

import gzip
import json
from base64 import b64encode
from collections.abc import Callable, Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

TEMPLATES = Path(__file__).parent / "templates"


def render(
    template: str, filters: Mapping[str, Callable[..., object]], data: object = None, **context: Any
) -> str:
    """Fill a template.

    Parameters
    ----------
    template
        Its name in the folder ``templates``. Everything that it shows is escaped.
    filters
        Of the template, by name.
    data
        What the page's script draws, JSON; None: the page has no script.
    context
        The template's variables.
    """
    from jinja2 import Environment, FileSystemLoader

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(filters)
    context["style"] = (TEMPLATES / "page.css").read_text(encoding="utf-8")
    scripts = "'none'"
    if data is not None:
        # What users named is packed: none of it can end the script's element.
        context["data"] = packed(json.dumps(data, allow_nan=False).encode())
        context["script"] = (TEMPLATES / "report.js").read_text(encoding="utf-8")
        context["plotly"], hashed = packed_plotly()
        scripts = f"{hashed} {content_hash(context['script'])}"
    context["policy"] = "; ".join(
        (
            "default-src 'none'",
            "style-src 'unsafe-inline'",
            "img-src data: blob:",
            f"script-src {scripts}",
        )
    )
    return environment.get_template(template).render(context).rstrip() + "\n"


def packed(content: bytes) -> str:
    """gzip in base64, the same for the same content."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def content_hash(script: str) -> str:
    """A script as a content security policy names it."""
    return f"'sha256-{b64encode(sha256(script.encode()).digest()).decode('ascii')}'"


@cache
def packed_plotly() -> tuple[str, str]:
    """plotly.js, packed (2 MB instead of 5), and its hash for the policy."""
    from plotly.offline import get_plotlyjs

    # A browser reads every line's end as \n.
    script = get_plotlyjs().replace("\r\n", "\n")
    return packed(script.encode()), content_hash(script)

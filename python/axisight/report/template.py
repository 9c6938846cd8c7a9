"""Pages from templates: all values escaped, missing values an error, no outside resources or scripts."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from importlib import resources
from typing import Any

import jinja2
from markupsafe import Markup

from axisight.report.colors import palette_css
from axisight.report.wording import unbroken


def rendered(
    name: str, page: dict[str, Any], *, styles: Sequence[str] = (), script: str | None = None
) -> str:
    """Return the filled template ``name`` of this package; raises jinja2.UndefinedError for a missing value.

    ``styles`` and ``script`` name further files in the same folder. The content policy allows only these and
    the files that all pages share, by their hashes. Browsers run nothing else and fetch nothing.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("axisight.report", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_unbroken,
    )
    style = "\n".join([palette_css(), *map(_source, ("page.css", *styles))])
    code = None if script is None else _source(script)
    own = {
        "policy": _policy(style, code),
        "style": Markup(style),
        "script": None if code is None else Markup(code),
    }
    return environment.get_template(name).render(page | own).strip() + "\n"


def _unbroken(value: Any) -> Any:
    """Return a text with no-break spaces between numbers and units; markup stays as it is."""
    return unbroken(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _source(name: str) -> str:
    return resources.files("axisight.report").joinpath("templates", name).read_text("utf-8")


def _policy(style: str, script: str | None) -> str:
    """Return the content policy of a page that has only this style and this script."""
    rules = ["default-src 'none'", "base-uri 'none'", "form-action 'none'"]
    rules.append(f"style-src '{_digest(style)}'")
    if script is not None:
        rules.append(f"script-src '{_digest(script)}'")
    return "; ".join(rules)


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

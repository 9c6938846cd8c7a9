"""Pages from templates: everything escaped, nothing left out silently."""

from __future__ import annotations

from typing import Any

import jinja2


def rendered(name: str, page: dict[str, Any]) -> str:
    """Return the template ``name`` of this package filled in; raises jinja2.UndefinedError for a gap."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("axisight.report", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name).render(page).strip() + "\n"

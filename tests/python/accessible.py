"""WCAG 2 AA checks of pages by axe-core, in a real browser."""

from importlib import resources
from typing import Any

# The two of axe's four grades that keep a person from reading or using a page.
_GRAVE = ("serious", "critical")
_RUN = """async () => {
  const found = await axe.run(document, { resultTypes: ["violations"] });
  return [found.passes.length, found.violations.map(
    rule => [rule.impact, rule.id, rule.nodes.map(node => node.html.slice(0, 200))])];
}"""


def grave_findings(page: Any) -> list[Any]:
    """Return the findings of axe-core on an open page that are serious or worse: grade, rule, elements.

    ``page``: a Playwright page, in a context that bypasses the content policy.
    """
    axe = resources.files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
    page.evaluate(axe)
    passed, broken = page.evaluate(_RUN)
    # Axe must have checked something.
    assert passed > 5
    return [finding for finding in broken if finding[0] in _GRAVE]

"""Pages held against WCAG 2 AA by axe-core, in the browser that shows them."""

from importlib import resources
from typing import Any

# Of axe's four grades, those that keep somebody from reading or using a page.
_GRAVE = ("serious", "critical")
_RUN = """async () => {
  const found = await axe.run(document, { resultTypes: ["violations"] });
  return [found.passes.length, found.violations.map(
    rule => [rule.impact, rule.id, rule.nodes.map(node => node.html.slice(0, 200))])];
}"""


def grave_findings(page: Any) -> list[Any]:
    """What axe-core finds on an open page that is serious or worse: grade, rule and elements.

    ``page``: of Playwright, in a context that bypasses the content policy.
    """
    axe = resources.files("axe_playwright_python").joinpath("axe.min.js").read_text("utf-8")
    page.evaluate(axe)
    passed, broken = page.evaluate(_RUN)
    # It did look.
    assert passed > 5
    return [finding for finding in broken if finding[0] in _GRAVE]

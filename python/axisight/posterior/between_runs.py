"""Which parameters really vary between runs, as a result."""

from __future__ import annotations

from dataclasses import dataclass

from axisight.display.summary import summarized


@summarized
@dataclass(frozen=True)
class BetweenRuns:
    """Variation of one parameter between the estimation logs.

    - ``std``: standard deviation between logs, in the unit of the parameter; zero if the logs need none.
    - ``p_value`` [1]: probability of logs that differ as much although the parameter is constant; None if fewer
      than two logs determine the parameter.
    - ``varies``: whether the parameter varies, at 5 % false alarms over all parameters together (Holm 1979).
    - ``by_log``: estimate of each log less the joint estimate; NaN for a log that does not determine it.
    """

    parameter: str
    std: float
    p_value: float | None
    varies: bool
    by_log: tuple[float, ...]

    @property
    def says(self) -> str:
        """``"yes"``, ``"no"``, or ``"not known"`` where fewer than two logs determine the parameter."""
        if self.p_value is None:
            return "not known"
        return "yes" if self.varies else "no"

"""Why the validation logs contradict what the estimation logs say: facts, no words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Contradiction = Literal["noise", "loud", "axis", "refit", "part", "fall", "bent", "none", "gear"]
"""What the validation logs contradict.

| value | meaning |
|---|---|
| ``noise`` | the estimated noise is larger than the gap: the data have a fault |
| ``loud`` | noise is so large a share of the torque that no gap would be clear |
| ``axis`` | the causes of one axis do not shrink its gap |
| ``refit`` | the causes leave more than the re-fit alone |
| ``part`` | the causes remove a part of the gap, too little to be all |
| ``fall`` | the causes hardly remove anything |
| ``bent`` | the causes need the simulator's own parameters at the edge of their tolerance |
| ``gear`` | both encoders contradict a gear of the simulator, and no cause is found |
| ``none`` | no effect is missing on the estimation logs, but the validation logs have a gap |
"""


@dataclass(frozen=True)
class Withdrawal:
    """A contradiction between estimation and validation logs, with its figures.

    ``before``, ``after`` and ``floor``: gap on the validation logs [1] without and with the causes, and of
    noise alone; of one log where ``log`` is given, of one axis (from 1) where ``axis`` is. ``causes``:
    labels of what is withdrawn. ``share``: of own parameters at the edge of their tolerance [1], where
    ``why`` is ``"bent"``; where it is ``"gear"``, the error of the gear in standard deviations.
    """

    why: Contradiction
    before: float = 0.0
    after: float = 0.0
    floor: float = 0.0
    axis: int | None = None
    log: str | None = None
    causes: tuple[str, ...] = ()
    share: float = 0.0

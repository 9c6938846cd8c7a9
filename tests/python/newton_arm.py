"""Arms in Newton's solver MuJoCo, on the CPU in double precision."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Torques of the joints (n,) [Nm] at a time [s], their angles and speeds.
Command = Callable[[float, Array, Array], Array]


class NewtonArm:
    """A USD stage in Newton, without contacts."""

    def __init__(self, path: Path) -> None:
        import newton  # noqa: PLC0415 (no test needs it, see docs/usd.md)
        import warp  # noqa: PLC0415

        warp.config.quiet = True
        self.newton = newton
        builder = newton.ModelBuilder()
        newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        resolvers = [
            newton.usd.SchemaResolverNewton(),
            newton.usd.SchemaResolverPhysx(),
            newton.usd.SchemaResolverMjc(),
        ]
        builder.add_usd(str(path), schema_resolvers=resolvers)
        self.model = builder.finalize(device="cpu")

    def run(
        self, command: Command, start: Array, duration_s: float, step_s: float
    ) -> tuple[Array, Array, Array]:
        """Return angles, speeds and commanded torques (n_steps, n) from rest at ``start``, at the start of steps."""
        model = self.model
        solver: Any = self.newton.solvers.SolverMuJoCo(
            model, use_mujoco_cpu=True, disable_contacts=True
        )
        now, then, control = model.state(), model.state(), model.control()
        now.joint_q.assign(np.asarray(start, dtype=np.float32))
        now.joint_qd.zero_()
        self.newton.eval_fk(model, now.joint_q, now.joint_qd, now)
        kept: list[tuple[Array, Array, Array]] = []
        for k in range(round(duration_s / step_s)):
            angle, speed = (
                np.array(x.numpy(), dtype=np.float64) for x in (now.joint_q, now.joint_qd)
            )
            torque = command(k * step_s, angle, speed)
            control.joint_f.assign(torque.astype(np.float32))
            kept.append((angle, speed, torque))
            now.clear_forces()
            solver.step(now, then, control, None, step_s)
            now, then = then, now
        angles, speeds, torques = (np.array(x) for x in zip(*kept, strict=True))
        return angles, speeds, torques

"""Make ``reference_small.json``: rigid-body numbers of the preset robot by Pinocchio.

Run from the root of the repository: ``python tests/golden/make_reference_small.py``.
"""

import datetime
import hashlib
import json
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

import pinocchio_model  # noqa: E402

SEED = 20261121
ROBOT = "python/axisight/robot/presets/irb6600_like.toml"
POINT = [0.3, -0.2, 0.5]


def main() -> None:
    """Write the file."""
    text = (ROOT / ROBOT).read_text()
    model = pinocchio_model.build(text)
    data = model.createData()
    rng = np.random.default_rng(SEED)
    states = []
    for _ in range(4):
        q, v, a = rng.uniform(-2, 2, (3, model.nq))
        mass = pinocchio_model.inertia_matrix(model, data, q)
        jacobian = pinocchio_model.point_jacobian(model, data, q, model.nq - 1, np.array(POINT))
        tau = np.array(pin.rnea(model, data, q, v, a))
        pin.forwardKinematics(model, data, q)
        tip = data.oMi[model.nq]
        states.append(
            {
                "q": q.tolist(),
                "v": v.tolist(),
                "a": a.tolist(),
                "inertia_matrix": mass.tolist(),
                "bias": np.array(pin.rnea(model, data, q, v, 0 * a)).tolist(),
                "gravity": np.array(pin.rnea(model, data, q, 0 * v, 0 * a)).tolist(),
                "inverse_dynamics": tau.tolist(),
                "forward_dynamics": np.array(pin.aba(model, data, q, v, a * 1e3)).tolist(),
                "last_rotation": tip.rotation.tolist(),
                "last_origin": tip.translation.tolist(),
                "last_jacobian": jacobian.tolist(),
                "kinetic": float(pin.computeKineticEnergy(model, data, q, v)),
                "potential": float(pin.computePotentialEnergy(model, data, q)),
            }
        )
    document = {
        "provenance": {
            "made_by": "tests/golden/make_reference_small.py",
            "made_on": datetime.datetime.now(datetime.UTC).date().isoformat(),
            "oracle": f"Pinocchio {pin.__version__}: crba, rnea, aba, frame Jacobian, energies",
            "robot": ROBOT,
            "robot_sha256": hashlib.sha256(text.encode()).hexdigest(),
            "seed": SEED,
            "units": "SI; forward_dynamics is under joint forces 1000 a",
        },
        "point": POINT,
        "states": states,
    }
    target = Path(__file__).with_name("reference_small.json")
    target.write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()

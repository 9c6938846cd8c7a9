"""Which average over realizations comes nearest to the truth? Takes a few seconds.

Repetitive disturbances do not average out over periods, only over realizations of the
excitation; and the arithmetic and the logarithmic mean are not biased alike.
"""

from pathlib import Path

import numpy as np

from axisight import load_robot, montecarlo

STUDY = Path(__file__).with_name("study.toml")

if __name__ == "__main__":
    result = montecarlo.run(STUDY, out="monte_carlo_out", resume=True)
    frequency = result.frequency_hz.values
    omega = 2 * np.pi * frequency[:, None, None]
    true = load_robot("irb6600_like").zoh_response(frequency).values * -(omega**2)
    print(f"{int(result['count'].max())} realizations, {len(montecarlo.failures(result))} failed")
    print("median relative error over the band, element by element:")
    for name in ("arithmetic_mean", "log_mean", "harmonic_mean"):
        error = np.median(np.abs(result[name].values / true - 1), axis=0)
        print(f"{name}:\n{np.round(error, 3)}")

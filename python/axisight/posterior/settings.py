"""Numbers behind a posterior. A diagnosis decides nothing by them."""

CORRELATED = 0.5
"""Absolute correlation [1] above which two parameters must be drawn together."""

FALSE_ALARMS = 0.05
"""Probability of calling any constant parameter one that varies between runs [1]."""

DETERMINED = 0.5
"""Least share of a parameter's change that the step of one log recovers, for the log to determine the parameter [1]."""

TELLS = 0.05
"""Least information of a log on a parameter, relative to the mean over logs [1].

A log that tells far less shows small errors of formulas as a large change of the parameter.
"""

BOOTSTRAP_DRAWS = 500
"""Draws of the block bootstrap that the covariance is compared with; a standard deviation is known to 3 %."""

HELD_OUT_DRAWS = 50
"""Samples that are simulated along each validation log; a standard deviation is known to 10 %."""

HELD_OUT_TIMES = 2000
"""Most samples in time that a Dataset of a validation log keeps."""

FIRST_NOISE_RUN = 1000
"""First run of the noise on held-out torque, behind the runs of the floor."""

MOST_RIVALS = 5
"""Most hypotheses beside the leading one; each is fitted once more."""

LEAST_ODDS = 0.02
"""Least weight of a rival that stays open, relative to the cause [1]."""

STEP_LEFT = 0.1
"""Largest distance from the optimum, in standard errors, at which the fit of a posterior ends.

It takes 0.1 % from the coverage of a 95 % interval.
"""

SMALLEST_STEP = 1e-8
"""Step at which the fit of a posterior ends, relative to the scale of a parameter [1]; the loss ends it earlier."""

"""Joint uncertainty of a finished diagnosis: covariance, rivals, variation between runs, held-out torque."""

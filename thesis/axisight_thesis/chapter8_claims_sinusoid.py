"""The claims of section 8.3.2 on a single sinusoid, with computed verdicts."""

from __future__ import annotations

from axisight_thesis.chapter8_sinusoid import single_frequency_error, single_frequency_snr
from axisight_thesis.context import Context
from axisight_thesis.item import Result, Statements

CLAIMS = Statements("8.3.2")


@CLAIMS.claim(
    "8.3.2-sinusoid",
    "A single sinusoid raises the signal-to-noise ratio by 20 dB or more on average.",
)
def _sinusoid(context: Context) -> Result:
    ratio = single_frequency_snr(context)
    gain = (ratio[0] - ratio[1]).mean(axis=(1, 2))
    text = f"mean gain: input {gain[0]:.0f} dB, output {gain[1]:.0f} dB"
    return bool(gain.min() > 20), text


@CLAIMS.claim("8.3.2-error", "A single sinusoid is much more accurate in every element.")
def _sinusoid_error(context: Context) -> Result:
    sinusoid, multisine = single_frequency_error(context)
    gain = multisine / sinusoid
    text = (
        f"multisine {100 * multisine.min():.0f} to {100 * multisine.max():.0f} %, sinusoid "
        f"{100 * sinusoid.min():.2f} to {100 * sinusoid.max():.2f} %, gain at least {gain.min():.0f}"
    )
    return bool(gain.min() > 10), text

"""Write the signals of a diagnosis to files for plotting tools: Parquet, MCAP."""

from axisight.signal_files.target import check_target
from axisight.signal_files.write import write_signals

__all__ = ["check_target", "write_signals"]

"""Write the signals of a diagnosis to files for plotting tools: Parquet, MCAP with a layout, Rerun."""

from axisight.signal_files.target import check_target, files_of
from axisight.signal_files.write import write_signals

__all__ = ["check_target", "files_of", "write_signals"]

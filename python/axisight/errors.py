"""The exceptions Axisight raises on purpose."""


class AxisightError(Exception):
    """Root of every error raised by Axisight."""


class InputError(AxisightError, ValueError):
    """Misuse or bad data; the message names the field, what was expected and what came."""


class LogError(InputError):
    """A log or its column map cannot be used."""


class CaseError(InputError):
    """A gap case folder cannot be used."""


class RobotError(InputError):
    """A robot model cannot be used."""


class ContactError(LogError):
    """Something outside of the model acts on a floating base, such as a contact with the ground.

    ``intervals_s`` are the times (begin, end) [s] at which it acts, from the first sample.
    """

    def __init__(self, message: str, intervals_s: tuple[tuple[float, float], ...] = ()) -> None:
        """Keep message and intervals."""
        super().__init__(message)
        self.intervals_s = intervals_s


class NotPeriodicError(InputError):
    """A signal does not repeat within its record."""


class OutputError(InputError, OSError):
    """A file or folder cannot be written; the message says which, and what is in the way."""


class MissingExtraError(AxisightError, ImportError):
    """A library of an optional extra is not installed; the message names the extra."""


class ConvergenceError(AxisightError, RuntimeError):
    """An iteration that the caller demanded to converge did not."""


class StudyError(InputError):
    """A Monte Carlo study cannot be used, or is not the one a store was made with."""


class StoreError(AxisightError):
    """A store of results cannot be written or read; what was finished before is kept."""


class BackendError(AxisightError):
    """Workers or their scheduler are out of reach; what was finished before is kept."""


class IdentifiabilityError(InputError):
    """The data do not determine the parameters asked for; the message names them, with advice."""


class IdentificationWarning(UserWarning):
    """An estimate is doubtful; the message says why and what to do."""

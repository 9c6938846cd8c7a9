"""Scalar arithmetic that is written down instead of carried out.

A model coded once over these scalars can be printed as straight-line source for any
compiler: numba for the SciPy and SUNDIALS peers, DiffSL for pydiffsol. Equal expressions
are kept once, and products with zero and one vanish, as one would do by hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field

FUNCTIONS = ("sin", "cos", "exp", "abs", "tanh")


@dataclass(frozen=True)
class Node:
    """One operation: its name and the numbers of its operands, or the text of a leaf."""

    operation: str
    operands: tuple[int, ...] = ()
    text: str = ""
    value: float | None = None


@dataclass
class Tape:
    """All operations in the order in which they must be carried out."""

    nodes: list[Node] = field(default_factory=list)
    index: dict[Node, int] = field(default_factory=dict)

    def put(self, node: Node) -> Scalar:
        number = self.index.get(node)
        if number is None:
            number = len(self.nodes)
            self.nodes.append(node)
            self.index[node] = number
        return Scalar(self, number)

    def leaf(self, text: str) -> Scalar:
        """A quantity given from outside, by its name in the printed source."""
        return self.put(Node("leaf", text=text))

    def constant(self, value: float) -> Scalar:
        return self.put(Node("constant", value=float(value)))

    def lift(self, x: Scalar | float) -> Scalar:
        return x if isinstance(x, Scalar) else self.constant(x)

    def call(self, function: str, x: Scalar | float) -> Scalar:
        return self.put(Node(function, (self.lift(x).number,)))


@dataclass(frozen=True, eq=False)
class Scalar:
    """A number on a tape."""

    tape: Tape
    number: int

    @property
    def value(self) -> float | None:
        """The number itself when it is a constant."""
        return self.tape.nodes[self.number].value

    def __add__(self, other: Scalar | float) -> Scalar:
        other = self.tape.lift(other)
        a, b = self.value, other.value
        if a is not None and b is not None:
            return self.tape.constant(a + b)
        if a == 0:
            return other
        if b == 0:
            return self
        pair = sorted((self.number, other.number))
        return self.tape.put(Node("+", tuple(pair)))

    def __sub__(self, other: Scalar | float) -> Scalar:
        other = self.tape.lift(other)
        a, b = self.value, other.value
        if a is not None and b is not None:
            return self.tape.constant(a - b)
        if b == 0:
            return self
        if a == 0:
            return -other
        if self.number == other.number:
            return self.tape.constant(0.0)
        return self.tape.put(Node("-", (self.number, other.number)))

    def __neg__(self) -> Scalar:
        if self.value is not None:
            return self.tape.constant(-self.value)
        node = self.tape.nodes[self.number]
        if node.operation == "neg":
            return Scalar(self.tape, node.operands[0])
        return self.tape.put(Node("neg", (self.number,)))

    def __mul__(self, other: Scalar | float) -> Scalar:
        other = self.tape.lift(other)
        a, b = self.value, other.value
        if a is not None and b is not None:
            return self.tape.constant(a * b)
        if a == 0 or b == 0:
            return self.tape.constant(0.0)
        for x, y in ((a, other), (b, self)):
            if x == 1:
                return y
            if x == -1:
                return -y
        pair = sorted((self.number, other.number))
        return self.tape.put(Node("*", tuple(pair)))

    def __truediv__(self, other: Scalar | float) -> Scalar:
        other = self.tape.lift(other)
        if other.value is not None:
            return self * (1.0 / other.value)
        if self.value == 0:
            return self
        return self.tape.put(Node("/", (self.number, other.number)))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: float) -> Scalar:
        return self.tape.lift(other) - self

    def __rtruediv__(self, other: float) -> Scalar:
        return self.tape.lift(other) / self


def lines(results: list[Scalar], longest: int = 160) -> tuple[list[tuple[str, str]], list[str]]:
    """Assignments ``(name, expression)`` and the expressions of the results.

    What is used once is written where it is used, up to ``longest`` characters: fewer
    variables, which compilers of straight-line code take a long time over.
    """
    tape = results[0].tape
    uses = _uses(tape, results)
    text: dict[int, str] = {}
    assignments = []
    for number, node in enumerate(tape.nodes):
        if uses[number] == 0:
            continue
        shown = _expression(node, text)
        leaf = node.operation in ("leaf", "constant")
        if leaf or (uses[number] == 1 and len(shown) <= longest):
            text[number] = shown
        else:
            text[number] = f"v{number}"
            assignments.append((text[number], shown))
    return assignments, [text[r.number] for r in results]


def operations(results: list[Scalar]) -> int:
    """Number of arithmetic operations and function calls in one evaluation."""
    tape = results[0].tape
    used = _uses(tape, results)
    return sum(1 for n, u in zip(tape.nodes, used, strict=True) if u and n.operation not in _LEAVES)


_LEAVES = ("leaf", "constant")


def _uses(tape: Tape, results: list[Scalar]) -> list[int]:
    uses = [0] * len(tape.nodes)
    for r in results:
        uses[r.number] += 1
    # Operands come before what uses them, so one pass from the end reaches everything.
    for number in reversed(range(len(tape.nodes))):
        if uses[number]:
            for operand in tape.nodes[number].operands:
                uses[operand] += 1
    return uses


def _expression(node: Node, text: dict[int, str]) -> str:
    if node.operation == "leaf":
        return node.text
    if node.operation == "constant":
        return f"({node.value!r})" if node.value < 0 else repr(node.value)
    operands = [text[i] for i in node.operands]
    if node.operation == "neg":
        return f"(-{operands[0]})"
    if node.operation in FUNCTIONS:
        return f"{node.operation}({operands[0]})"
    return f"({operands[0]} {node.operation} {operands[1]})"

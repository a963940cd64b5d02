"""Hooks: Warp functions that a step loop calls where chains differ, collected in dataclasses with checked arguments."""

from dataclasses import MISSING, field, fields
from typing import Any


def hook(*, otherwise: Any = MISSING, **arguments: Any) -> Any:
    """A field that holds a Warp function with arguments of these names and types, in this order.

    ``otherwise`` is the hook of those who give none. A hook that has no use for an argument may put an underscore
    before its name.
    """
    return field(default=otherwise, metadata={"arguments": arguments})


class Hooks:
    """Base of dataclasses of hooks.

    A hook with other arguments than its field declares is a ``TypeError`` when the dataclass is made, which names both.
    Warp itself would say so only when it compiles the loop, by the call that does not fit.
    """

    def __post_init__(self) -> None:
        """Compare the arguments of all hooks with those declared."""
        for declared in fields(self):  # type: ignore[arg-type] # subclasses are dataclasses
            function, wanted = getattr(self, declared.name), declared.metadata.get("arguments")
            if wanted is None or function is None:
                continue
            given = {name.removeprefix("_"): kind for name, kind in function.input_types.items()}
            if [*given.items()] != [*wanted.items()]:
                name = f"{type(self).__name__}.{declared.name}"
                raise TypeError(f"{name}: expected arguments {wanted}, got {given} of {function.key}")

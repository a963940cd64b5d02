"""The step protocol: what both step loops do with a world, in which order, and the hooks that they call.

:mod:`cpu.loop` and :mod:`gpu.loop` carry a world on in these parts; comments in both name them.

- *Load*: the links, their constants under the present loads, and the plane. After the host has set the links, also
  the sums of the plane (``begin_run``), the neighbour list and the distance to the floor or sprocket.
- *Sample*, when a mark is due: what is recorded and watched, see :mod:`events.sample`. It may change softness and
  loads, whose constants links and joints then take (``take_constants``). The run may end here.
- *Length*: the step is the proposed one, unless that could miss a contact or passes the stop time.
- *Attempt*: the plane moves to the middle of the step (``begin_step``), where it stays for all stages (``attempt``).
- *Accept*, if the error is at most 1: links, time and proposed step (``accept``), then the plane (``end_step``).
- *Reject*, otherwise: nothing but the proposed step changes, and the run may end.
- *Contacts* after an accepted step: first with floor or sprocket (``meet``), then of links with one another. An impulse
  makes the first stage void.
- *Store*: a last sample, if the run has ended between two; links, losses and counters.

A GPU repeats length, attempt and accept or reject until a sample is due or something is near.

Hooks are Warp functions for those parts in which chains differ: ``PlaneHooks`` of both devices, ``Joints`` of a CPU,
``BlockSteps`` of a GPU. Hooks of the same name have the same task on both devices. Dataclasses collect them.
"""

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

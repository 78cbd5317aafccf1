"""How far the blocks of a batch are, and what takes long in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from flexband.basics.progress import Pace, Progress
from flexband.mechanics.assembly.structure import WorkSpace
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.free_steps.slowness import slow_steps
from flexband.mechanics.engine.threads import in_parallel


@dataclass(frozen=True)
class BlocksUnderWay:
    """The work spaces of blocks that are simulated now, which other threads may look at.

    Attributes
    ----------
    blocks, steps : numbers of all blocks, and of the steps of each.
    """

    system: System
    blocks: int
    steps: int
    works: dict[int, WorkSpace] = field(default_factory=dict)
    finished: set[int] = field(default_factory=set)

    def run(
        self,
        simulate: Callable[[int], int],
        samples: int,
        threads: int,
        progress: Progress | None,
    ) -> None:
        """Simulate all blocks, and show how far they are; `simulate` returns its samples."""
        pace = Pace(self.steps, self.part, self.slowness)

        def finish(block: int) -> int:
            count = simulate(block)
            self.finish(block)
            return count

        in_parallel(finish, self.blocks, samples, threads, progress, pace)
        pace.end()

    def part(self) -> float:
        """Return the part of all steps that is done; it grows."""
        reached = sum(float(work.reached[0, 0]) for work in list(self.works.values()))
        return (len(self.finished) * self.steps + reached) / (self.blocks * self.steps)

    def finish(self, block: int) -> None:
        """Note that a block is done."""
        self.works.pop(block, None)
        self.finished.add(block)

    def slowness(self) -> str:
        """Return what the steps follow that samples choose; "" if they are given."""
        texts = (slow_steps(self.system, work) for work in list(self.works.values()))
        return next(filter(None, texts), "")

"""How long a search for a cause may go on, counted in work and not in seconds: every machine ends it at the same place."""

from __future__ import annotations

from dataclasses import dataclass

OVERHEAD = 64  # configurations: what it costs to begin with a factor, whatever the number of configurations
LIMIT = 300_000_000  # of factors times configurations: ten times what seven joints take if nothing is found
LONG = 20  # joints: in longer chains there are too many pairs of joints to exchange or couple
LIMIT_LONG = 50_000_000
LONGEST = 100  # joints: of longer chains nothing is searched


class SearchEndedError(Exception):
    """The budget is used up."""


@dataclass
class Budget:
    """The work that one search has done, and may do.

    joints: of the chain.
    work: how much it has done, in factors of a mechanism times configurations.
    evaluations: in how many steps.
    ended: whether it wanted to do more than it may.
    """

    joints: int
    work: int = 0
    evaluations: int = 0
    ended: bool = False

    @property
    def limit(self) -> int:
        """How much work it may do."""
        return 0 if self.joints > LONGEST else LIMIT_LONG if self.pairs_left_out else LIMIT

    @property
    def pairs_left_out(self) -> bool:
        """Whether exchanged and coupled joints are left out of the search."""
        return self.joints > LONG

    def spend(self, factors: int, configurations: int) -> None:
        """Count a step before it is taken. Raises SearchEndedError if it would be too much."""
        work = factors * (OVERHEAD + configurations)
        if self.work + work > self.limit:
            self.ended = True
            raise SearchEndedError
        self.work += work
        self.evaluations += 1

    def begin_again(self) -> None:
        """Let another search do as much, as the first was not in vain."""
        self.work, self.evaluations, self.ended = 0, 0, False

    def remark(self) -> str:
        """What a search that found nothing did not look for, in words; empty if it looked for everything."""
        if self.joints > LONGEST:
            return f"no cause is searched for in chains of more than {LONGEST} joints, these have {self.joints}"
        remarks = [f"the search was ended after {self.evaluations} evaluations"] if self.ended else []
        if self.pairs_left_out:
            remarks.append(f"exchanged or coupled joints are not searched for in chains of more than {LONG} joints")
        return "; ".join(remarks)

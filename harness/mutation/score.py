"""The score of a mutation run: typed, written as JSON, printed as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Literal

from rich.console import Console
from rich.text import Text

from harness.mutation.mutant import Mutant
from harness.rendering.tables import bare_table
from harness.report.parts import Part
from harness.report.text import plain

Outcome = Literal["caught", "missed", "below the floor", "left alone", "false alarm", "refused"]

COLUMNS = ("caught", "missed", "below the floor", "equivalent, not flagged", "false alarms", "refused", "cause named")


class Trial(Part):
    """One mutant seen by one source.

    outcome:
        `caught` or `missed`: flagged, or not, and it can be seen.
        `below the floor`: it cannot be seen at this source's tolerance, which is no pass.
        `left alone` or `false alarm`: not flagged, or flagged, and the same mechanism as this source reads it.
        `refused`: the source did not take it.
    effect: how far it moves any frame [m or rad].
    cause_named: whether the first group of changes names the cause, with joint and size; None if none was looked for.
    told: the explanation as text.
    note: why it was missed, not seen or refused.
    """

    robot: str
    source: str
    mutant: str
    side: str
    operator: str
    outcome: Outcome
    effect: float = 0.0
    cause_named: bool | None = None
    told: str = ""
    note: str = ""

    @classmethod
    def of(
        cls, mutant: Mutant, source: str, outcome: Outcome, *,
        effect: float = 0.0, cause_named: bool | None = None, told: str = "", note: str = "",
    ) -> Trial:  # fmt: skip
        """A trial of this mutant."""
        return cls(
            robot=mutant.model.name,
            source=source,
            mutant=mutant.name,
            side=mutant.side,
            operator=mutant.operator,
            outcome=outcome,
            effect=effect,
            cause_named=cause_named,
            told=told,
            note=note,
        )


class Tally(Part):
    """Counts of outcomes, and of caught ones whose cause was named."""

    trials: int
    caught: int
    missed: int
    below: int
    left_alone: int
    false_alarms: int
    refused: int
    named: int

    @classmethod
    def of(cls, trials: Iterable[Trial]) -> Tally:
        """Count."""
        trials = list(trials)
        n = Counter(t.outcome for t in trials)
        return cls(
            trials=len(trials),
            caught=n["caught"],
            missed=n["missed"],
            below=n["below the floor"],
            left_alone=n["left alone"],
            false_alarms=n["false alarm"],
            refused=n["refused"],
            named=sum(t.cause_named is True for t in trials),
        )


class MutationScore(Part):
    """The whole run. `sources_left_out`: those that could not take part, with the reason."""

    format: Literal["fk-crosscheck mutation score"] = "fk-crosscheck mutation score"
    version: Literal["1.0"] = "1.0"
    every: int
    seconds: float
    sources_left_out: list[str]
    total: Tally
    by_robot: dict[str, Tally]
    by_source: dict[str, Tally]
    by_operator: dict[str, Tally]
    trials: list[Trial]

    @property
    def exit_code(self) -> int:
        """0 if all that could be seen was caught, and nothing else."""
        return 1 if self.total.missed or self.total.false_alarms or self.total.refused else 0


def score(trials: Sequence[Trial], every: int, seconds: float, left_out: list[str]) -> MutationScore:
    """Tallies of all trials."""

    def by(key: str) -> dict[str, Tally]:
        names = dict.fromkeys(str(getattr(t, key)) for t in trials)
        return {name: Tally.of(t for t in trials if getattr(t, key) == name) for name in names}

    return MutationScore(
        every=every,
        seconds=seconds,
        sources_left_out=left_out,
        total=Tally.of(trials),
        by_robot=by("robot"),
        by_source=by("source"),
        by_operator=by("operator"),
        trials=list(trials),
    )


def show(result: MutationScore, console: Console, most: int = 40) -> None:
    """Print the tables, then the first `most` trials that are not as they should be."""
    for title, tallies in (("robot", result.by_robot), ("source", result.by_source), ("operator", result.by_operator)):
        table = bare_table(title)
        for column in COLUMNS:
            table.add_column(column, justify="right", overflow="fold")
        for name, t in (*tallies.items(), ("all", result.total)):
            share = f"{t.named} of {t.caught}" + (f", {100.0 * t.named / t.caught:.1f} %" if t.caught else "")
            cells = (t.caught, t.missed, t.below, t.left_alone, t.false_alarms, t.refused)
            table.add_row(Text(plain(name)), *(str(c) for c in cells), share)
        console.print(table)
        console.print()
    wrong = [t for t in result.trials if t.outcome in ("missed", "false alarm", "refused") or t.cause_named is False]
    for trial in wrong[:most]:
        what = "cause not named" if trial.outcome == "caught" else trial.outcome
        text = f"{what}: {trial.robot}, {trial.source}: {trial.mutant}: {trial.told or trial.note}"
        console.print(Text(plain(text)), soft_wrap=True)
    if len(wrong) > most:
        console.print(Text(f"and {len(wrong) - most} more in the JSON"))
    for text in result.sources_left_out:
        console.print(Text(plain(f"left out: {text}"), style="yellow"), soft_wrap=True)

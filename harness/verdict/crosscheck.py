"""One robot model in, one report document out."""

from __future__ import annotations

from harness.description.model import RobotModel
from harness.report.document import Report
from harness.run.checkpoint import Checkpoints
from harness.run.options import Options
from harness.run.robot import run_robot
from harness.run.streaming import Progress
from harness.verdict.accepted import AcceptedNumbers
from harness.verdict.assemble import assemble
from harness.workers.pool import Workers


def crosscheck(
    model: RobotModel,
    options: Options,
    progress: Progress | None = None,
    workers: Workers | None = None,
    accepted: AcceptedNumbers | None = None,
    checkpoints: Checkpoints | None = None,
) -> Report:
    """Cross-check one robot model.

    model: the robot model.
    options: what is asked.
    progress: called as `progress(done, total)` after each block of configurations.
    workers: used and left open, so that the next robot need not start them again; None: workers of its own.
    accepted: the numbers on file, if the report is to say what moved since.
    checkpoints: where a long run keeps how far it has come; None: nowhere.

    Raises InputError for wrong options. A missing or failing engine is part of the report.
    """
    return assemble(run_robot(model, options, progress, workers, checkpoints), accepted)

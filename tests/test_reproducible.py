"""The same document whatever the processor, the threads and the hash seed: fixed kernels, and rounded numbers."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness import kernels, se3
from harness.comparison.statistics import Stream
from harness.description.model import RobotModel
from harness.digits import anchored, as_fine_as, coordinate, discrepancy, lower_bound, upper_bound
from harness.engines.registry import adapter_of
from harness.report.parts import Discrepancy
from harness.report.pose import FramePair
from harness.report.proof_parts import FrameBound
from harness.report.source_parts import Statistics, Validity
from harness.workers.pool import Workers

SIZES = st.floats(1e-18, 1e6)


@given(SIZES)
def test_a_number_that_is_read_back_is_written_the_same(x: float) -> None:
    for write in (discrepancy, upper_bound, lower_bound, coordinate):
        assert write(write(x)) == write(x)
    pair = anchored(x, x + 1e-11)
    assert anchored(*pair) == pair


@given(SIZES)
def test_a_bound_stays_a_bound(x: float) -> None:
    assert lower_bound(x) <= x <= upper_bound(x)
    assert upper_bound(x) - x <= 1.1e-8 * x
    assert x - lower_bound(x) <= 1.1e-5 * x


@pytest.mark.parametrize(
    ("x", "written"),
    [
        (4.4e-16, 0.0),
        (2.0682310711e-13, 2.1e-13),
        (2.0848345767e-12, 2.1e-12),
        (3.0091234567891e-4, 3.009123457e-4),
        (3.1415926415286, 3.141593),
    ],
)
def test_a_discrepancy_has_the_digits_that_mean_something(x: float, written: float) -> None:
    assert discrepancy(x) == written


def test_a_mean_is_written_no_finer_than_the_largest() -> None:
    numbers = {"count": 1, "mean": 1.55518161166, "p50": 0.0, "p95": 0.0, "p99": 0.0, "decades": {}, "worst": None}
    assert Statistics.model_validate({"max": 3.1, **numbers}).mean == as_fine_as(1.55518161166, 3.1) == 1.555182


def test_two_placements_keep_what_is_between_them() -> None:
    def placement(x: float) -> list[list[float]]:
        return [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]

    pair = FramePair(frame="f", reference=placement(0.123456789123456), source=placement(0.123456789123456 + 5.23e-12))
    assert (pair.reference[0][3], pair.source[0][3]) == (0.1234567891, 0.1234567891052)
    assert FramePair.model_validate_json(pair.model_dump_json()) == pair


def test_types_of_the_document_write_numbers() -> None:
    """Rounding is done where a document is built, by the types of its fields."""
    assert Validity(checked=1, invalid=0, residual=8.9e-16).residual == 0.0
    bound = FrameBound(
        frame="f",
        position_upper=2.1410000001e-12,
        position_found=2.1419999e-12,
        rotation_upper=0.0,
        rotation_found=0.0,
        slope=None,
        method="grid",
    )
    assert (bound.position_upper, bound.position_found) == (2.14100001e-12, 2.14199e-12)
    assert discrepancy in [getattr(part, "func", None) for part in Discrepancy.__metadata__]  # type: ignore[attr-defined]


def test_the_worst_is_the_first_of_those_written_alike() -> None:
    stream = Stream(2)
    stream.update(0, np.array([[1e-3, 2e-3, 2e-3 + 1e-15], [0.0, 3e-16, 4e-16]]))
    stream.update(3, np.array([[2e-3 + 2e-15, 1e-3, 0.0], [0.0, 0.0, 5e-16]]))
    assert stream.argmax.tolist() == [1, 0]
    assert stream.max.tolist() == [2e-3 + 2e-15, 5e-16]
    stream.update(6, np.array([[2.1e-3], [2e-14]]))
    assert stream.argmax.tolist() == [6, 6]


def test_what_is_at_a_power_of_ten_but_for_rounding_has_reached_it() -> None:
    stream = Stream(1)
    stream.update(0, np.array([[1e-3, 1e-3 - 1e-16, 1e-3 + 1e-16, 0.0, 1e-16]]))
    assert stream.decades(0) == {-3: 3, -15: 2}


def test_rotations_that_cancel_out_have_the_first_as_their_mean() -> None:
    turns = np.array([se3.rotation("z", 2.0 * np.pi * i / 7) @ se3.rotation("x", np.pi * i) for i in range(14)])
    for noise in (0.0, 1e-16, -1e-16):
        shaken = turns.copy()
        shaken[1:, :3, :3] += noise * np.arange(9).reshape(3, 3)
        assert np.array_equal(se3.mean_transform(shaken)[:3, :3], turns[0, :3, :3])


RUN = """
import sys, numpy
from harness import api
from harness.report.json_file import to_json
from harness.run.options import Options
a = numpy.random.default_rng(0).random((40, 4, 4))
print((a @ a[0]).sum().hex(), numpy.linalg.svd(a.reshape(40, 16))[1].sum().hex())  # differs with the kernels
for model in sys.argv[1:]:
    options = Options(in_process=True, command="crosscheck run")
    text = to_json(api.crosscheck(model, sources=("dh:pinocchio", "urdf:yourdfpy"), samples=300, options=options))
    print(text[:text.index('"environment": {')])
"""


def test_other_kernels_give_the_same_document(copy_model: Callable[..., Path]) -> None:
    """The API, in a process whose NumPy is there already, cannot fix the kernels: rounding alone does it."""
    faulty = copy_model("ur5", ("dh.csv", "0.089159", "0.089460"), ("dh.csv", "-0.425", "-0.426"))
    command, texts = [sys.executable, "-c", RUN, "sixr", str(faulty), "ur5"], []
    for core, disabled in (("Prescott", "AVX2 FMA3"), ("Haswell", "")):
        env = {**os.environ, "OPENBLAS_CORETYPE": core, "NPY_DISABLE_CPU_FEATURES": disabled}
        texts.append(
            subprocess.run(command, env=env, capture_output=True, text=True, check=True, timeout=170).stdout.splitlines()
        )
    if texts[0][0] == texts[1][0]:
        pytest.skip("NumPy here has no OpenBLAS that chooses its kernels by the processor")
    assert len(texts[0]) > 1000
    assert texts[0][1:] == texts[1][1:]


def test_jobs_threads_hash_seed_and_kernels_of_the_command(
    cli: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    sources = ("--source", "dh:pinocchio", "--source", "urdf:yourdfpy", "--source", "urdf:pinocchio")
    documents = []
    for folder, jobs, env in (
        ("a", "1", {"PYTHONHASHSEED": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_CORETYPE": "Haswell"}),
        ("b", "4", {"PYTHONHASHSEED": "2", "OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "4", "OPENBLAS_CORETYPE": "Prescott"}),
    ):
        done = cli("run", "ur5", *sources, "--samples", "300", "--jobs", jobs, "--out", folder, **env)
        assert done.returncode == 0, done.stderr
        text = (tmp_path / folder / "ur5.json").read_text()
        documents.append(text[: text.index('"environment": {')])
    assert documents[0] == documents[1]


def test_kernels_are_fixed_whatever_the_environment_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    environ = {"OPENBLAS_CORETYPE": "Zen", "PATH": "/bin"}
    kernels.fix_kernels(environ)
    assert environ == {
        "PATH": "/bin", "OPENBLAS_CORETYPE": "Prescott", "MKL_CBWR": "COMPATIBLE", "ATEN_CPU_CAPABILITY": "default",
    }  # fmt: skip
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    assert "OPENBLAS_CORETYPE" not in kernels.kernels()


COMMAND = """
import os, sys
sys.argv = ["crosscheck", "frames", "sixr"]
from harness.__main__ import main
assert "numpy" not in sys.modules
try:
    main()
finally:
    assert "numpy" in sys.modules
    print(os.environ["MKL_CBWR"], file=sys.stderr)
"""


def test_the_command_has_fixed_kernels_before_numpy_is_there() -> None:
    env = {**os.environ, "MKL_CBWR": "AVX2"}
    done = subprocess.run([sys.executable, "-c", COMMAND], env=env, capture_output=True, text=True, timeout=120, check=True)
    assert done.stderr == "COMPATIBLE\n"


def test_workers_have_fixed_kernels(monkeypatch: pytest.MonkeyPatch, models: dict[str, RobotModel]) -> None:
    """Those of the API too, whose own process may have other kernels."""
    monkeypatch.setenv("MKL_CBWR", "AVX2")
    model = models["sixr"]
    assert model.urdf is not None
    with Workers() as workers:
        workers.load(adapter_of("urdf:pinocchio"), model.urdf, model.urdf.links)
        running = [child for child in psutil.Process().children(recursive=True) if "worker.py" in " ".join(child.cmdline())]
        assert "COMPATIBLE" in {child.environ().get("MKL_CBWR") for child in running}

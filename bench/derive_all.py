"""derive-dh on every chain, root to leaf, of every URDF in example-robot-data: a table and a proof for both, or the reason.

Prints what was not reproduced, file by file, and a count. Exits 1 if a chain is neither reproduced nor refused with a reason.
"""

from __future__ import annotations

import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from importlib import metadata
from pathlib import Path

from harness.convert.derive import derive
from harness.convert.verify import verify
from harness.description.urdf_file import read_urdf
from harness.description.urdf_lint import check
from harness.errors import CrosscheckError

SOURCE = "urdf:pinocchio"


def one_file(path: Path) -> list[tuple[str, str, str, float]]:
    """(chain, outcome, reason, proven bound) of each chain of one file."""
    try:
        urdf = read_urdf(path)
        check(urdf)
    except CrosscheckError as error:
        return [(path.name, "refused", str(error).split(": ", 1)[-1], 0.0)]
    results = []
    for leaf in (link for link in urdf.links if not urdf.children(link)):
        chain = f"{path.name}: {urdf.roots[0]} to {leaf}"
        try:
            derived = derive(urdf, urdf.roots[0], leaf, "standard", SOURCE)
            report = verify(derived, "robot", SOURCE, None)
        except CrosscheckError as error:
            results.append((chain, "refused", str(error).split(": ", 1)[-1], 0.0))
            continue
        except Exception as error:  # what must not happen: told, and counted
            results.append((chain, "BROKEN", f"{type(error).__name__}: {error}", 0.0))
            continue
        certificate = report.sources[1].certificate
        upper = max((b.position_upper for b in certificate.frames), default=0.0) if certificate else 0.0
        outcome = "reproduced" if report.verdict.exit_code == 0 else "NOT REPRODUCED"
        results.append((chain, outcome, "" if outcome == "reproduced" else report.verdict.sentence, upper))
    return results


def main() -> int:
    """Run over all files on all cores."""
    files = [Path(str(f.locate())) for f in metadata.files("example-robot-data") or [] if str(f).endswith(".urdf")]
    counts: Counter[str] = Counter()
    reasons: Counter[str] = Counter()
    largest = 0.0
    with ProcessPoolExecutor() as pool:
        for results in pool.map(one_file, files):
            for chain, outcome, reason, upper in results:
                counts[outcome] += 1
                largest = max(largest, upper if outcome == "reproduced" else 0.0)
                if outcome not in ("reproduced", "refused"):
                    print(f"{outcome}: {chain}: {reason}", flush=True)
                if outcome == "refused":
                    reasons[" ".join(word for word in reason.split() if not word.startswith("'"))[:70]] += 1
    print(f"{len(files)} files: " + ", ".join(f"{n} {outcome}" for outcome, n in counts.items()))
    print(f"largest proven bound of those reproduced: {largest:.1e} m")
    for reason, n in reasons.most_common():
        print(f"  {n} refused: {reason}")
    return 1 if counts["BROKEN"] or counts["NOT REPRODUCED"] else 0


if __name__ == "__main__":
    sys.exit(main())

"""Cost of a verb on N ranks, fitted to what few of them took.

    T(N, D) = s0 + s1 D + c D / N                     CPU-seconds of the busiest rank
            + read(D) / min(N B_rank, B_storage)      its input, from shared storage
            + written(D) / B_rank                     its output, by the root
            + messages(N, D) L + bytes(N, D) / B_net  of the busiest rank

D is the size of the data. Messages and bytes are (a + b D) f(N), f the one of SHAPES that
fits best what was counted; but messages of a queue of tiles as it hands them out, see handed().
A case may say `most_ranks` that share its work, `most_size` of data beyond which what they
share doesn't grow, and that sums go along a `chain` of ranks, each waiting for the one
before.
"""

import itertools
import math

# Assumed, not measured.
LATENCY_S = 20e-6
NETWORK = 10e9 / 8
STORAGE_OF_RANK = 1e9
STORAGE = 10e9

MANY = (8, 64, 512)
FULL = 277**2 * 39**2 * 3  # values of the largest dataset there is, 1.4 GB
SAMPLES = 64  # a pixel
PICTURE = 512**2 * SAMPLES
TILE = 8  # pixels along a side, render/sample_plan.h

SHAPES = {
    "1 − 1/N": lambda n: 1 - 1 / n,  # everybody's share to the root
    "log₂ N": lambda n: math.ceil(math.log2(n)),  # sums along a tree
    "N − 1": lambda n: n - 1,  # the root with each
}


def handed(ranks, size):
    """Of the tiles of a pass that other ranks get from the root (render/job_queue.cc): a
    4 N-th of what is left at a time, while that is a tile or more. There are no more of
    them than tiles."""
    tiles = size / SAMPLES / TILE**2
    parts = 4 * ranks
    most = parts * (1 + math.log(max(1.0, tiles / parts)))
    return 2 * min(tiles, most) * (1 - 1 / ranks)  # there and back


def solve(matrix, right):
    """Gauss with pivots; None if singular."""
    size = len(right)
    rows = [[*matrix[k], right[k]] for k in range(size)]
    for k in range(size):
        pivot = max(range(k, size), key=lambda r: abs(rows[r][k]))
        if abs(rows[pivot][k]) < 1e-12:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for r in range(size):
            if r != k:
                factor = rows[r][k] / rows[k][k]
                rows[r] = [a - factor * b for a, b in zip(rows[r], rows[k])]
    return [rows[k][size] / rows[k][k] for k in range(size)]


def least_squares(columns, right):
    """The non-negative combination of columns with the least relative error."""
    weights = [1 / max(abs(y), 1e-9) for y in right]
    best = ([0.0] * len(columns), math.inf)
    for count in range(1, len(columns) + 1):
        for chosen in itertools.combinations(range(len(columns)), count):
            # Of about the same size each.
            scale = [max(abs(w * v) for w, v in zip(weights, columns[j])) or 1 for j in chosen]
            a = [[w * columns[j][k] / s for j, s in zip(chosen, scale)] for k, w in enumerate(weights)]
            y = [w * v for w, v in zip(weights, right)]
            normal = [[sum(row[i] * row[j] for row in a) for j in range(count)] for i in range(count)]
            found = solve(normal, [sum(row[i] * v for row, v in zip(a, y)) for i in range(count)])
            if found is None or min(found) < 0:
                continue
            error = math.sqrt(sum((sum(f * v for f, v in zip(found, row)) - v0) ** 2
                                  for row, v0 in zip(a, y)) / len(y))
            if error < best[1] - 1e-12:
                result = [0.0] * len(columns)
                for j, s, f in zip(chosen, scale, found):
                    result[j] = f / s
                best = (result, error)
    return best


def candidates(case, key):
    """Forms of messages or bytes as functions of ranks and data, each with its terms."""
    if key == "messages" and case.get("queue"):
        return {"queue": [("handed(N, D)", handed), ("(N − 1)", lambda n, d: n - 1)]}
    return {name: [(f"({name})", lambda n, d, f=f: f(n)),
                   (f"D ({name})", lambda n, d, f=f: d * f(n))] for name, f in SHAPES.items()}


def fit_traffic(case, key):
    shared = [row for row in case["rows"] if row["ranks"] > 1]
    best = None
    for terms in candidates(case, key).values():
        columns = [[f(r["ranks"], r["size"]) for r in shared] for _, f in terms]
        factors, error = least_squares(columns, [r[key] for r in shared])
        if best is None or error < best["error"] - 1e-3:
            best = {"terms": [(factor, *term) for factor, term in zip(factors, terms)],
                    "error": error}
    return best


def shared_size(case, ranks, size):
    """What a rank has of the work that is shared."""
    return min(size, case.get("most_size", size)) / min(ranks, case.get("most_ranks", ranks))


def fit(case):
    rows = case["rows"]
    columns = [[1.0] * len(rows), [r["size"] for r in rows],
               [shared_size(case, r["ranks"], r["size"]) for r in rows]]
    (s0, s1, c), error = least_squares(columns, [r["busiest"] for r in rows])
    return {"s0": s0, "s1": s1, "c": c, "error": error,
            "messages": fit_traffic(case, "messages"), "bytes": fit_traffic(case, "bytes")}


def traffic(of, ranks, size):
    return sum(factor * f(ranks, size) for factor, _, f in of["terms"])


def parts(case, of, ranks, size):
    """Seconds by what they go to."""
    largest = case["rows"][-1]
    is_data = not case.get("queue")
    read = case["passes"] * size * case.get("read_bytes_a_value", 4)
    # Datasets grow with their rows; a material or a map of clusters too, but is small.
    written = largest["written"] * size / largest["size"]
    moved = min(size, case.get("most_size", size))
    hops = min(ranks, case["most_ranks"]) if case.get("chain") else 1
    network = 0
    if ranks > 1:
        network = hops * (traffic(of["messages"], ranks, moved) * LATENCY_S
                          + traffic(of["bytes"], ranks, moved) / NETWORK)
    return {
        "compute": of["c"] * shared_size(case, ranks, size),
        "serial": of["s0"] + of["s1"] * size,
        "storage": (read / min(ranks * STORAGE_OF_RANK, STORAGE)
                    + (written / STORAGE_OF_RANK if is_data else 0)),
        "network": network,
    }


def time_text(seconds):
    for unit, length in (("d", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.2g} s"


def measured_table(cases):
    lines = ["| verb | data | ranks | CPU-s, busiest rank | CPU-s, all | wall, s | speed-up by CPU-s "
             "| messages | bytes |", "|" + "---|" * 9]
    for case in cases:
        alone = {r["size"]: r["busiest"] for r in case["rows"] if r["ranks"] == 1}
        for r in case["rows"]:
            lines.append(
                f"| {case['name']} | {r['label']} | {r['ranks']} | {r['busiest']:.2f} | {r['cpu']:.2f} "
                f"| {r['wall']:.2f} | {alone[r['size']] / r['busiest']:.2f} "
                f"| {r.get('messages_in_all', 0)} | {r.get('bytes_in_all', 0)} |")
    return lines


def fitted_table(cases, fits):
    lines = ["| verb | s0, s | s1, µs a thousand values | c, µs a thousand values | misfit "
             "| messages, busiest rank | bytes, busiest rank |", "|" + "---|" * 7]
    for case, of in zip(cases, fits):
        terms = [" + ".join(f"{factor:.3g} {label}" for factor, label, _ in t["terms"] if factor) or "0"
                 for t in (of["messages"], of["bytes"])]
        lines.append(f"| {case['name']} | {of['s0']:.2f} | {1e9 * of['s1']:.2f} | {1e9 * of['c']:.1f} "
                     f"| {100 * of['error']:.0f} % | {terms[0]} | {terms[1]} |")
    return lines


def modelled_table(cases, fits):
    lines = ["| verb | times | 1 rank | " + " | ".join(f"{n} ranks" for n in MANY)
             + " | of the last: compute, serial, storage, network |", "|" + "---|" * (len(MANY) + 4)]
    for case, of in zip(cases, fits):
        unit = PICTURE if case.get("queue") else FULL
        for times in (10, 1000):
            size = times * unit
            by_ranks = [parts(case, of, n, size) for n in (1, *MANY)]
            totals = [time_text(sum(p.values())) for p in by_ranks]
            last = ", ".join(time_text(v) for v in by_ranks[-1].values())
            lines.append(f"| {case['name']} | {times} × | " + " | ".join(totals) + f" | {last} |")
    return lines


def tables(cases):
    fits = [fit(case) for case in cases]
    return [measured_table(cases), fitted_table(cases, fits), modelled_table(cases, fits)]


def replace_tables(page, blocks):
    """The page with each of its tables that begins with the heading of one of `blocks` as that."""
    lines = page.split("\n")
    for block in blocks:
        first = lines.index(block[0])
        end = first
        while end < len(lines) and lines[end].startswith("|"):
            end += 1
        lines[first:end] = block
    return "\n".join(lines)

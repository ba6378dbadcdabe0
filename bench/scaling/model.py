"""Cost of a verb on N ranks, fitted to what few of them took.

    T(N, D) = s0 + s1 D + c D / N                     CPU-seconds of the busiest rank
            + read(D) / min(N B_rank, B_storage)      its input, from shared storage
            + written(D) / B_rank                     its output, by the root
            + messages(N, D) L + bytes(N, D) / B_net  of the busiest rank

D is the size of the data. Messages and bytes are (a + b D) f(N), f the one of SHAPES that
fits best what was counted.
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
PICTURE = 512**2 * 64  # samples

SHAPES = {
    "1 − 1/N": lambda n: 1 - 1 / n,  # everybody's share to the root
    "log₂ N": lambda n: math.ceil(math.log2(n)),  # sums along a tree
    "N − 1": lambda n: n - 1,  # the root with each
}


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


def fit_traffic(rows, key):
    shared = [row for row in rows if row["ranks"] > 1]
    best = None
    for name, shape in SHAPES.items():
        columns = [[shape(r["ranks"]) for r in shared],
                   [shape(r["ranks"]) * r["size"] for r in shared]]
        (a, b), error = least_squares(columns, [r[key] for r in shared])
        if best is None or error < best["error"] - 1e-3:
            best = {"shape": name, "a": a, "b": b, "error": error}
    return best


def fit(case):
    rows = case["rows"]
    columns = [[1.0] * len(rows), [r["size"] for r in rows], [r["size"] / r["ranks"] for r in rows]]
    # Measured on one size, what is serial is one of the two.
    for one, column in (("s0", 1), ("s1", 0)):
        if case.get("serial") == one:
            columns[column] = [0.0] * len(rows)
    (s0, s1, c), error = least_squares(columns, [r["busiest"] for r in rows])
    return {"s0": s0, "s1": s1, "c": c, "error": error,
            "messages": fit_traffic(rows, "messages"), "bytes": fit_traffic(rows, "bytes")}


def traffic(of, ranks, size):
    return (of["a"] + of["b"] * size) * SHAPES[of["shape"]](ranks)


def parts(case, of, ranks, size):
    """Seconds by what they go to."""
    largest = case["rows"][-1]
    is_data = case["name"] != "render"
    read = case["passes"] * size * case.get("read_bytes_a_value", 4)
    # Datasets grow with their rows; a material or a map of clusters too, but is small.
    written = largest["written"] * size / largest["size"]
    shared = ranks > 1
    return {
        "compute": of["c"] * size / ranks,
        "serial": of["s0"] + of["s1"] * size,
        "storage": (read / min(ranks * STORAGE_OF_RANK, STORAGE)
                    + (written / STORAGE_OF_RANK if is_data else 0)),
        "network": (traffic(of["messages"], ranks, size) * LATENCY_S
                    + traffic(of["bytes"], ranks, size) / NETWORK) if shared else 0,
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
        terms = [f"({t['a']:.3g} + {t['b']:.3g} D) ({t['shape']})" for t in (of["messages"], of["bytes"])]
        lines.append(f"| {case['name']} | {of['s0']:.2f} | {1e9 * of['s1']:.2f} | {1e9 * of['c']:.1f} "
                     f"| {100 * of['error']:.0f} % | {terms[0]} | {terms[1]} |")
    return lines


def modelled_table(cases, fits):
    lines = ["| verb | data | " + " | ".join(f"{n} ranks" for n in (1, *MANY))
             + " | of the last: compute, serial, storage, network |", "|" + "---|" * (len(MANY) + 4)]
    for case, of in zip(cases, fits):
        unit = PICTURE if case["name"] == "render" else FULL
        for times in (10, 1000):
            size = times * unit
            by_ranks = [parts(case, of, n, size) for n in (1, *MANY)]
            totals = [time_text(sum(p.values())) for p in by_ranks]
            last = ", ".join(time_text(v) for v in by_ranks[-1].values())
            lines.append(f"| {case['name']} | {times} × | " + " | ".join(totals) + f" | {last} |")
    return lines


def tables(cases):
    fits = [fit(case) for case in cases]
    blocks = [measured_table(cases), fitted_table(cases, fits), modelled_table(cases, fits)]
    return "\n\n".join("\n".join(lines) for lines in blocks)

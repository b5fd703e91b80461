#!/usr/bin/env python3
"""A second reader of what `omentum study` writes: every score is computed anew from the raw files, and compared.

    check_study.py contact|methods|calibration|sheet DIR [PRINTED]

DIR is the folder of a study, PRINTED a file with what the program printed. From the runs, the truth and errors.csv this
program computes errors, medians, quartiles, means and the bar with formulas of its own, and holds study.json, runs.csv,
errors.csv, the tables of report.html and PRINTED against them. Exit code 1 and one line for each disagreement.
"""
import csv
import html.parser
import json
import math
import pathlib
import re
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import gallery  # noqa: E402
import picture_row  # noqa: E402

METHODS = ["penalty", "multipliers", "prescribed"]
TITLES = {"penalty": "Penalty", "multipliers": "LM", "prescribed": "PrescrDispl", "rigid": "rigid model"}
BY_TITLES = {"finite_elements": "finite elements, prescribed", "particles": "particles, calibrated",
             "umesh": "U-Mesh", "rigid": "rigid"}
wrong = []


def same(what, found, expected, tol=1e-6):
    """Numbers: |found - expected| <= tol max(1, |expected|)."""
    if found is None or not abs(found - expected) <= tol * max(1.0, abs(expected)):
        wrong.append(f"{what}: {found}, computed {expected}")


def equal(what, found, expected):
    if found != expected:
        wrong.append(f"{what}: {found!r}, computed {expected!r}")


def printed_as(what, text, expected, digits):
    """A number of a table: `expected` with so many digits behind the point."""
    same(what, float(text), expected, 0.51 * 10 ** -digits / max(1.0, abs(expected)))


def load(path):
    return json.loads(path.read_text())


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def distance(a, b):
    return math.dist(a, b)


def along(point, step, direction):
    return [p + step * d for p, d in zip(point, direction)]


class Report(html.parser.HTMLParser):
    """Tables as lists of rows of cells, facts as a dictionary, the verdict and all other text."""

    def __init__(self, path):
        super().__init__()
        self.tables, self.facts, self.verdict, self.is_good, self.text = [], {}, "", None, ""
        self.where, self.label, self.skip = None, "", 0
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        kind = dict(attrs).get("class") or ""
        if tag in ("svg", "style", "script"):
            self.skip += 1
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append([])
        if tag in ("td", "th") and self.tables:
            self.tables[-1][-1].append("")
            self.where = "cell"
        if tag == "dt":
            self.where, self.label = "label", ""
        if tag == "dd":
            self.where = "fact"
            self.facts[self.label] = ""
        if tag == "div" and kind.startswith("verdict"):
            self.where, self.is_good = "verdict", "good" in kind.split()

    def handle_endtag(self, tag):
        if tag in ("svg", "style", "script"):
            self.skip -= 1
        if tag in ("td", "th", "dt", "dd", "div"):
            self.where = None

    def handle_data(self, data):
        if self.skip:
            return
        self.text += data
        if self.where == "cell":
            self.tables[-1][-1][-1] += data
        elif self.where == "label":
            self.label += data
        elif self.where == "fact":
            self.facts[self.label] += data
        elif self.where == "verdict":
            self.verdict += data

    def table(self, first, *others):
        """The table whose head begins with this cell and holds the others."""
        for table in self.tables:
            if table[0][0] == first and all(o in table[0] for o in others):
                return table
        wrong.append(f"report.html: no table begins with {first!r}")
        return [[]]


def sample(values):
    """Mean, spread and quartiles: the inclusive method of the statistics module."""
    n = len(values)
    out = {"n": n}
    if n:
        low, mid, high = statistics.quantiles(values, n=4, method="inclusive") if n > 1 else values * 3
        out.update(mean=statistics.fmean(values), sd=statistics.stdev(values) if n > 1 else 0.0, min=min(values),
                   lower_quartile=low, median=mid, upper_quartile=high, max=max(values))
    return out


def same_sample(what, found, values):
    for key, value in sample(values).items():
        same(f"{what}: {key}", found.get(key), value)


def verdict_is(report, is_met, printed, dir_name):
    equal("report.html: the verdict's colour", report.is_good, is_met)
    if printed is not None:
        equal(f"what is printed names {dir_name}", dir_name in printed, True)


# ---- contact ------------------------------------------------------------------------------------------------

def check_run(run, path, settings):
    """The facts of one path, each by its definition."""
    depths = [r["depth"] for r in run["reached"]]
    went = run["ndone"] * settings["speed"] * settings["time_step"]
    equal(f"{path.name}: a path without a reason is complete", run["reason"] == "", run["ndone"] == run["nstep"])
    equal(f"{path.name}: steps", len(run["step"]), run["ndone"] + (run["reason"] != ""))
    equal(f"{path.name}: depths reached", all(d <= went + 1e-9 for d in depths), True)
    done = run["step"][:run["ndone"]]
    for k, step in enumerate(done):
        if not (step["residual"] <= 1.000001 * settings["tolerance"] and step["ms"] > 0
                and step["penetration"] <= settings["max_penetration"] and step["force"] >= 0):
            wrong.append(f"{path.name}: step {k + 1} does not count: {step}")
    # the tissue pushes the probe back, the more the deeper it is
    if len(done) > 20 and not done[-1]["force"] > done[len(done) // 3]["force"] > done[2]["force"] > 0:
        wrong.append(f"{path.name}: the force does not grow")


def contact_error(run, truth, k):
    """mm; None where path or truth did not come so far."""
    if k >= len(run["reached"]) or k >= len(truth):
        return None
    return 1e3 * distance(run["reached"][k]["lesion"], truth[k]["measured"])


def check_contact_csv(folder, runs, errors):
    for row in rows(folder / "runs.csv"):
        run = runs[row["method"], int(row["elements_wanted"]), int(row["lesion"])]
        step = run["step"]
        ms = [s["ms"] for s in step]
        name = f"runs.csv, {row['method']} {row['elements_wanted']} {row['lesion']}"
        equal(f"{name}: elements", int(row["elements"]), run["ntet"])
        equal(f"{name}: steps", (int(row["steps"]), int(row["completed"])), (run["nstep"], run["ndone"]))
        printed_as(f"{name}: median", row["step_ms_median"], statistics.median(ms), 4)
        printed_as(f"{name}: least", row["step_ms_min"], min(ms), 4)
        printed_as(f"{name}: most", row["step_ms_max"], max(ms), 4)
        printed_as(f"{name}: penetration", row["penetration_max_mm"], 1e3 * max(s["penetration"] for s in step), 5)
        same(f"{name}: residual", float(row["residual_max"]), max(s["residual"] for s in step), 1e-5)
        equal(f"{name}: substeps", int(row["substeps_max"]), max(s["substeps"] for s in step))
        printed_as(f"{name}: force", row["force_end_n"], step[-1]["force"], 5)
        printed_as(f"{name}: volume", row["volume_min"], run["volume_min"], 4)
        equal(f"{name}: reason", row["reason"], run["reason"])
    equal("runs.csv: rows", len(rows(folder / "runs.csv")), len(runs))
    found = rows(folder / "errors.csv")
    for row in found:
        key = row["method"], int(row["elements_wanted"]), int(row["lesion"]), float(row["depth_mm"])
        printed_as(f"errors.csv {key}", row["error_mm"], errors.get(key, math.inf), 5)
    equal("errors.csv: rows", len(found), len(errors))


def check_contact_report(report, study, cells, runs):
    met = sum(c["meets_bar"] for c in cells)
    whole = sum(r["ndone"] == r["nstep"] for r in runs.values())
    worst = min(100 * r["ndone"] / r["nstep"] for r in runs.values())
    equal("report: paths", report.facts.get("paths completed"), f"{whole} of {len(runs)}")
    equal("report: the worst", report.facts.get("of the path in the worst run"), f"{worst:.0f} %")
    equal("report: lesions", report.facts.get("lesions"), str(len(study["lesions"])))
    if met < len(cells) and f"{met} of {len(cells)}" not in report.verdict:
        wrong.append(f"report: the verdict is {report.verdict!r}")
    times = report.table("elements", "median, ms")[1:]
    share = {row[0]: row for row in report.table("elements", "thesis")[1:]}
    heads = report.table("elements", "thesis")[0]
    for cell in cells:
        name, title = f"{cell['method']} {cell['elements_wanted']}", TITLES[cell["method"]]
        row = [r for r in times if r[:2] == [str(cell["elements"]), title]]
        equal(f"report: times of {name}", len(row), 1)
        for text, key in zip(row[0][2:] if row else [], ["median", "min", "max"]):
            printed_as(f"report: {key} of {name}", text, cell["step_ms"][key], 2)
        s = cell["stability_percent"]
        equal(f"report: stability of {name}", share[str(cell["elements_wanted"])][heads.index(title)],
              f"{s['mean']:.0f}, {s['median']:.0f}, {s['min']:.0f}-{s['max']:.0f}")
    table = report.table("mean +- standard deviation, mm")
    for row in table[1:]:
        for head, text in zip(table[0][1:], row[1:]):
            values = [d["error_mm"] for d in study["error_by_depth_mm"]
                      if TITLES[d["method"]] == row[0] and f"D{1e3 * d['depth']:.0f}" == head][0]
            expected = f"{values['mean']:.2f} +- {values['sd']:.2f}" if values["n"] else "-"
            equal(f"report: {row[0]} {head}", text, expected)
    missed = [c for c in cells if not c["meets_bar"]]
    if missed:
        told = [(r[0], r[1]) for r in report.table("elements", "why")[1:]]
        equal("report: what misses the bar", told, [(str(c["elements_wanted"]), TITLES[c["method"]]) for c in missed])


def check_pictures(folder):
    """Tissue fills the width of the pictures before and at the end of a press, and is not cut off."""
    for k, data in enumerate(gallery.embedded(folder / "report.html")[:2]):
        path = folder / "picture.png"
        path.write_bytes(data)
        width, height, lines = picture_row.read(path)
        is_tissue = [[line[3 * i] > 100 and line[3 * i] > line[3 * i + 2] for i in range(width)] for line in lines]  # red, the probe is blue
        across = [i for i in range(width) if any(row[i] for row in is_tissue)]
        if not (0 < across[0] < 0.08 * width and 0.92 * width < across[-1] < width - 1) or any(is_tissue[0] + is_tissue[-1]):
            wrong.append(f"picture {k + 1}: tissue from column {across[0]} to {across[-1]} of {width}")


def check_contact(folder, printed):
    study = load(folder / "study.json")
    settings, cells = study["settings"], study["cells"]
    meshes = sorted({c["elements_wanted"] for c in cells})
    methods = [m for m in METHODS if any(c["method"] == m for c in cells)]
    truth = {i + 1: lesion["truth"] for i, lesion in enumerate(study["lesions"])}
    depths = sorted({d["depth"] for d in study["error_by_depth_mm"]})
    runs, errors, noises = {}, {}, []
    for i, lesion in enumerate(study["lesions"], 1):  # study.json repeats the files of the truth
        raw = load(folder / f"truth/lesion-{i:02}.json")
        equal(f"lesion {i}: depths of the truth", len(lesion["truth"]), len(raw["at"]))
        for told, at in zip(lesion["truth"], raw["at"]):
            equal(f"lesion {i}: truth", (told["depth"], told["lesion"], told["force"]), (at["depth"], at["fine"], at["force"]))
            noises.append(distance(told["measured"], at["fine"]))
    spread = math.hypot(settings["probe_noise"], settings["pointer_noise"])
    if not 0.2 * spread < statistics.fmean(noises) < 2.5 * spread or max(noises) > 4 * spread:
        wrong.append(f"noise of the tracking: {noises} m, of which the spread is {spread}")
    for m in methods:
        for n in meshes:
            for l in truth:
                path = folder / f"runs/{m}-{n:06}-{l:02}.json"
                run = runs[m, n, l] = load(path)
                equal(f"{path.name}: method, mesh, lesion", (run["method"], run["resolution"], run["lesion"]), (m, n, l - 1))
                check_run(run, path, settings)
                for k, reached in enumerate(run["reached"]):
                    error = contact_error(run, truth[l], k)
                    if error is not None:
                        errors[m, n, l, round(1e3 * reached["depth"], 6)] = error
    # a deformation counts on a mesh where every method completed it and the truth has it
    counts = {(n, l, k) for n in meshes for l in truth for k in range(len(depths))
              if all(contact_error(runs[m, n, l], truth[l], k) is not None for m in methods)}
    for cell in cells:
        m, n = cell["method"], cell["elements_wanted"]
        name = f"{m} {n}"
        of_cell = [runs[m, n, l] for l in truth]
        valid = [(l, k) for l in truth for k in range(len(depths)) if (n, l, k) in counts]
        mine = [contact_error(runs[m, n, l], truth[l], k) for l, k in valid]
        finest = [contact_error(runs[m, meshes[-1], l], truth[l], k) for l, k in valid]
        finest = [e for e in finest if e is not None]
        same_sample(f"{name}: stability", cell["stability_percent"], [100 * r["ndone"] / r["nstep"] for r in of_cell])
        same_sample(f"{name}: times", cell["step_ms"], [s["ms"] for r in of_cell for s in r["step"]])
        same_sample(f"{name}: errors", cell["error_mm"], mine)
        same(f"{name}: finest", cell["error_finest_mm"], statistics.fmean(finest) if finest else 0)
        misses = [f"lesion {r['lesion'] + 1}" for r in of_cell if r["ndone"] < r["nstep"]]
        is_far = of_cell[0]["ntet"] >= 2500 and mine and statistics.fmean(mine) > statistics.fmean(finest) + 0.3
        equal(f"{name}: the bar", cell["meets_bar"], not misses and not is_far)
        equal(f"{name}: why not", cell["why_not"] == "", cell["meets_bar"])
        if misses:
            equal(f"{name}: the paths are named", f"{len(misses)} of {len(of_cell)}" in cell["why_not"], True)
    for entry in study["error_by_depth_mm"]:
        k = depths.index(entry["depth"])
        if entry["method"] == "rigid":
            values = [1e3 * distance(along(le["center"], -depths[k], le["normal"]), truth[l][k]["measured"])
                      for l, le in enumerate(study["lesions"], 1) if k < len(truth[l])]
        else:
            values = [contact_error(runs[entry["method"], n, l], truth[l], k) for n, l, d in sorted(counts)
                      if d == k and entry["method"] in methods]
        same_sample(f"{entry['method']} at {depths[k]}", entry["error_mm"], values)
    raw = [at for l in truth for at in load(folder / f"truth/lesion-{l:02}.json")["at"]]
    same_sample("refinement", study["truth_refinement_mm"], [1e3 * distance(a["fine"], a["coarse"]) for a in raw])
    same_sample("forces", study["truth_force_refinement_percent"], [100 * abs(a["coarse_force"] / a["force"] - 1) for a in raw])
    same_sample("sink", study["truth_sink_mm"], [1e3 * abs(a["sink"]) for a in raw])
    check_contact_csv(folder, runs, errors)
    report = Report(folder / "report.html")
    check_contact_report(report, study, cells, runs)
    check_pictures(folder)
    met = sum(c["meets_bar"] for c in cells)
    verdict_is(report, met == len(cells), None, "")
    if printed is not None:
        whole = sum(r["ndone"] == r["nstep"] for r in runs.values())
        worst = 100 * min(r["ndone"] / r["nstep"] for r in runs.values())
        for expected in (f"{len(runs)} runs (", f": {whole} completed the path; the worst reached {worst:.0f} %",
                         f"all criteria are met by {met} of {len(cells)} combinations"):
            equal(f"printed: {expected!r}", expected in printed, True)


# ---- methods, calibration -----------------------------------------------------------------------------------

def table_of_errors(folder, first):
    """errors.csv as {(by, lesion, depth_mm): error_mm} and the deformations that count."""
    values, counts = {}, set()
    for row in rows(folder / "errors.csv"):
        key = row[first], int(row["lesion"]), float(row["depth_mm"])
        values[key] = float(row["error_mm"])
        if row["counts"] == "1":
            counts.add(key[1:])
    return values, counts


def check_geometry(study, values, names, folder, runs):
    """Errors of the rigid model and of finite elements from the positions themselves."""
    for at in study["measured"]:
        key = at["lesion"], round(1e3 * at["depth"], 6)
        rigid = 1e3 * distance(along(at["rest"], -at["depth"], at["normal"]), at["contour"])
        same(f"errors.csv: rigid {key}", values.get(("rigid", *key)), rigid, 1.1e-5)
        for by, stem in names.items():
            path = next((folder / runs).glob(f"{stem}-*-{at['lesion']:02}.json"))
            reached = [r for r in load(path)["reached"] if abs(r["depth"] - at["depth"]) < 1e-9]
            if reached:
                same(f"errors.csv: {by} {key}", values.get((by, *key)), 1e3 * distance(reached[0]["contour"], at["contour"]), 1.1e-5)
            else:
                equal(f"errors.csv: {by} {key}", (by, *key) in values, False)
    equal("errors.csv: rows of the rigid model", sum(k[0] == "rigid" for k in values), len(study["measured"]))


def mean(values):
    values = list(values)
    return statistics.fmean(values) if values else 0.0


def lesion_tables(report):
    return [t for t in report.tables if t and t[0][:2] == ["lesion", "D10"]]


def check_lesion_table(table, values, by):
    for row in table[1:]:
        lesion = int(row[0].split()[0])
        for head, text in zip(table[0][1:], row[1:]):
            value = values.get((by, lesion, float(head[1:]))) if head.startswith("D") else \
                mean(v for k, v in values.items() if k[:2] == (by, lesion))
            if value is None or (not value and not text.strip()):
                equal(f"report: {by}, lesion {lesion}, {head}", text.strip(), "")
            else:
                printed_as(f"report: {by}, lesion {lesion}, {head}", text.strip(" *"), value, 2)


def check_methods(folder, printed):
    study, report = load(folder / "study.json"), Report(folder / "report.html")
    values, counts = table_of_errors(folder, "method")
    names = list(BY_TITLES)
    check_geometry(study, values, {"finite_elements": "prescribed"}, folder, "runs")
    everywhere = {k[1:] for k in values if all((by, *k[1:]) in values for by in names)}
    equal("errors.csv: what counts", counts, everywhere)
    equal("deformations", study["deformations"], len(counts))
    depths = sorted({d for _, d in values.keys() and [k[1:] for k in values]})
    gaps, stable = [], True
    runs = [load(p) for p in sorted((folder / "runs").glob("prescribed-*.json"))]
    for by in names:
        entry = study[by]
        same(f"{by}: mean", entry["mean_error_mm"], mean(values[(by, *c)] for c in counts), 1e-5)
        by_depth = [mean(values[(by, *c)] for c in counts if c[1] == d) for d in depths]
        for d, found, expected in zip(depths, entry["error_by_depth_mm"], by_depth):
            same(f"{by} at {d}", found, expected, 1e-5)
        stable = stable and entry["stability"] > 1 - 1e-12
    for d in depths:
        if any(c[1] == d for c in counts):
            gaps.append(mean(values[("umesh", *c)] - values[("finite_elements", *c)] for c in counts if c[1] == d))
    worst = max(gaps) if gaps else 0
    same("worst gap", study["worst_gap_mm"], worst, 2e-5)
    is_met = bool(counts) and worst <= 0.3 and stable
    equal("the bar", study["bar_met"], is_met)
    same("stability of finite elements", study["finite_elements"]["stability"], mean(r["ndone"] / r["nstep"] for r in runs))
    same("stability of the rigid model", study["rigid"]["stability"], 1)
    ms = sorted(s["ms"] for r in runs for s in r["step"])
    same("a step of finite elements", study["finite_elements"]["step_ms"], ms[len(ms) // 2])
    equal("report: the verdict", ("met:" in report.verdict, report.is_good), (is_met, is_met))
    for row in report.table("", "a step, ms", "stability, %")[1:]:
        by = [k for k, title in BY_TITLES.items() if title == row[0]][0]
        if by != "rigid":
            printed_as(f"report: step of {by}", row[1], study[by]["step_ms"], 2)
        printed_as(f"report: stability of {by}", row[2], 100 * study[by]["stability"], 1)
        printed_as(f"report: mean of {by}", row[3], study[by]["mean_error_mm"], 2)
        printed_as(f"report: fact of {by}", report.facts[row[0]].split()[0], study[by]["mean_error_mm"], 2)
    for row in report.table("depth, mm", "lesions")[1:]:
        k, n = depths.index(float(row[0])), sum(c[1] == float(row[0]) for c in counts)
        equal(f"report: lesions at {row[0]}", row[1], str(n))
        if n:
            fe, net = (study[by]["error_by_depth_mm"][k] for by in ("finite_elements", "umesh"))
            for text, value in zip(row[2:], (fe, net, net - fe)):
                printed_as(f"report: at {row[0]} mm", text, value, 2)
    for table, by in zip(lesion_tables(report), names):
        check_lesion_table(table, values, by)
    equal("report: tables of lesions", len(lesion_tables(report)), len(names))
    if printed is not None:
        for by, word in zip(names, ["finite elements", "particles", "U-Mesh", "rigid"]):
            line = re.search(rf"^{word} +([\d.]+) mm +([\d.]+) ms +([\d.]+) %$", printed, re.M)
            equal(f"printed: a line of {by}", bool(line), True)
            if line:
                printed_as(f"printed: error of {by}", line[1], study[by]["mean_error_mm"], 2)
                printed_as(f"printed: step of {by}", line[2], study[by]["step_ms"], 2)
                printed_as(f"printed: stability of {by}", line[3], 100 * study[by]["stability"], 1)
        equal("printed: the bar", f"criteria: {'met' if is_met else 'missed'}\n" in printed, True)
        equal("printed: the gap", f"at most {worst:+.2f} mm over {len(counts)} deformations" in printed, True)


def best_of(path):
    """The evaluation of a journal with the least cost; a cost must be the mean of its errors."""
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    lines = [line for line in lines if isinstance(line.get("cost"), (int, float))]
    for line in lines:
        if "error" in line:
            same(f"{path}: cost of evaluation {line['k']}", 1e3 * line["cost"], 1e3 * mean(line["error"]), 1e-9)
    return min(lines, key=lambda line: line["cost"])


def check_calibration(folder, printed):
    study, report = load(folder / "study.json"), Report(folder / "report.html")
    values, counts = table_of_errors(folder, "by")
    names = sorted({k[0] for k in values})
    unseen = study["unseen_error_mm"]
    equal("names", sorted(k for k in unseen if k != "n"), names)
    check_geometry(study, values, {"prescribed": "prescribed", "penalty": "penalty"}, folder, "breast/runs")
    equal("errors.csv: what counts", counts,
          {k[1:] for k in values if k[2] >= 15 and all((by, *k[1:]) in values for by in names)})
    tuned = study["tuned_on_lesion"]
    others = [c for c in counts if c[0] != tuned]
    equal("unseen deformations", unseen["n"], len(others))
    for by in names:
        same(f"unseen, {by}", unseen[by], mean(values[(by, *c)] for c in others), 1e-5)
    # the search's own error is that of its lesion from 15 mm on
    mine = [v for (by, l, d), v in values.items() if by == "particles_tuned" and l == tuned and d >= 15]
    same("the error of the lesion tuned on", study["breast"]["error_mm"], mean(mine), 1e-4)
    is_met = bool(others) and unseen["particles_tuned"] <= 1.5 * unseen["prescribed"] and \
        study["breast"]["error_mm"] < study["breast"]["error_start_mm"]
    equal("the bar", study["bar_met"], is_met)
    equal("report: the verdict", ("met:" in report.verdict, report.is_good), (is_met, is_met))
    for row, search in zip(report.table("", "spacing, mm", "radius, mm")[1::2], ("gel", "breast")):
        keys = ["cluster_spacing_mm", "cluster_radius_mm", "cluster_stiffness", "error_start_mm", "error_mm"]
        for text, key, digits in zip(row[1:6], keys, (2, 2, 3, 2, 2)):
            printed_as(f"report: {search} {key}", text, study[search][key], digits)
        equal(f"report: evaluations of {search}", row[6], str(study[search]["evaluations"]))
    order = ["particles_gel", "particles_tuned", "prescribed", "penalty", "rigid"]
    for row, by in zip(report.table("unseen lesions, 15 to 30 mm")[1:], order):
        printed_as(f"report: unseen {by}", row[1], unseen[by], 2)
        if unseen["prescribed"] > 1e-3:
            printed_as(f"report: ratio {by}", row[2], unseen[by] / unseen["prescribed"], 2)
    for table, by in zip(lesion_tables(report), ("particles_tuned", "prescribed")):
        check_lesion_table(table, values, by)
    for search in ("gel", "breast"):
        files = list((folder / search).glob("search-*/journal.jsonl"))
        equal(f"{search}: journals", len(files), 1)
        for path in files:
            best = best_of(path)
            start = json.loads(path.read_text().splitlines()[1])
            same(f"{search}: first error of its journal", study[search]["error_start_mm"], 1e3 * start["cost"])
            same(f"{search}: least error of its journal", study[search]["error_mm"], 1e3 * best["cost"])
            for key, unit, p in zip(keys, (1e3, 1e3, 1), best["p"]):
                same(f"{search}: {key} of its journal", study[search][key], unit * p)
    if printed is not None:
        equal("printed: the bar", f"criterion: {'met' if is_met else 'missed'}\n" in printed, True)
        line = re.search(r"^unseen lesions: particles ([\d.]+) mm \(gel's parameters ([\d.]+)\), "
                         r"finite elements ([\d.]+), rigid ([\d.]+)$", printed, re.M)
        for text, by in zip(line.groups() if line else "0000", ("particles_tuned", "particles_gel", "prescribed", "rigid")):
            printed_as(f"printed: {by}", text, unseen[by], 2)


# ---- the sheet ----------------------------------------------------------------------------------------------

def check_sheet(folder, printed):
    study, report = load(folder / "study.json"), Report(folder / "report.html")

    def mean_but(table, held):
        return mean(mean(row) for i, row in enumerate(table, 1) if i != held)
    searches, thesis = study["searches"], study["thesis_by_pinch_and_lift"]
    first = searches[0]["error_by_pinch_and_lift"]
    same("found", study["error_found"], mean_but(first, None))
    same("thesis", study["error_thesis"], mean_but(thesis, None))
    for s in searches:
        held, table = s["held_out_pinch"], s["error_by_pinch_and_lift"]
        same(f"without {held}: seen", s["seen"], mean_but(table, held))
        same(f"without {held}: unseen", s["unseen"], mean(table[held - 1]))
        same(f"without {held}: thesis", s["unseen_thesis"], mean(thesis[held - 1]))
        best = best_of(folder / f"without-{held}/journal.jsonl")
        for key, p in zip(("cluster_spacing", "cluster_radius", "cluster_stiffness"), best["p"]):
            same(f"without {held}: {key} of its journal", s[key], p)
        same(f"without {held}: least error of its journal", s["seen"], best["cost"], 1e-5)
    same("unseen", study["unseen_found"], mean(s["unseen"] for s in searches))
    same("unseen, thesis", study["unseen_thesis"], mean(s["unseen_thesis"] for s in searches))
    goal = float(re.search(r"the goal of ([\d.]+) mm", report.verdict)[1]) * 1e-3
    same("the goal", goal, 0.002)
    is_met = study["error_found"] <= goal and study["unseen_found"] <= goal
    equal("the bar", study["is_met"], is_met)
    equal("report: the verdict's colour", report.is_good, is_met)
    facts = {"thesis's parameters": "error_thesis", "found": "error_found", "thesis's, unseen pinch": "unseen_thesis",
             "found, unseen pinch": "unseen_found", "sheet at rest": "error_unlifted"}
    for label, key in facts.items():
        printed_as(f"report: {label}", report.facts[label].split()[0], 1e3 * study[key], 2)
    equal("report: evaluations", report.facts["evaluations"], str(sum(s["evaluations"] for s in searches)))
    for i, row in enumerate(report.table("pinch point", "where")[1:]):
        found, other = ([t[i] for t in (first, thesis)] if i < len(first)
                        else [[mean(t[p][l] for p in range(len(t))) for l in range(3)] for t in (first, thesis)])
        for text, a, b in zip(row[2:], [*found, mean(found)], [*other, mean(other)]):
            one, two = re.fullmatch(r"([\d.]+) \(([\d.]+)\)", text).groups()
            printed_as(f"report: {row[0]}", one, 1e3 * a, 2)
            printed_as(f"report: {row[0]}, thesis", two, 1e3 * b, 2)
    for row, s in zip(report.table("held out", "spacing, mm")[2:], searches):
        for text, value, digits in zip(row[4:7], (s["seen"], s["unseen"], s["unseen_thesis"]), (2, 2, 2)):
            printed_as(f"report: {row[0]}", text, 1e3 * value, digits)
        for text, key, unit in zip(row[1:4], ("cluster_spacing", "cluster_radius", "cluster_stiffness"), (1e3, 1e3, 1)):
            same(f"report: {key}", float(text), unit * s[key], 6e-3)
    if printed is not None:
        line = re.search(r"^all clouds: ([\d.]+) mm .*, ([\d.]+) mm", printed, re.M)
        for text, key in zip(line.groups() if line else ("0", "0"), ("error_thesis", "error_found")):
            printed_as(f"printed: {key}", text, 1e3 * study[key], 2)


def main():
    kind, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    printed = pathlib.Path(sys.argv[3]).read_text() if len(sys.argv) > 3 else None
    {"contact": check_contact, "methods": check_methods, "calibration": check_calibration,
     "sheet": check_sheet}[kind](folder, printed)
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{kind}: every number agrees")


if __name__ == "__main__":
    main()

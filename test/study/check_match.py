#!/usr/bin/env python3
"""Compute the numbers of study.json of a study of correspondence, of layouts, of simulated bodies or of trust anew from its CSV file.

    check_match.py correspondence|attachments|simulated|trust DIR     exit 0 and "every number agrees", or one line per difference and exit 1
"""
import csv
import json
import sys

MOVED_MM = 5.0


def numbers_of(rows, way):
    judged = [row for row in rows if float(row["moved_mm"]) >= MOVED_MM + 0.01]
    # moved_mm has two digits: points at the limit are in doubt
    doubt = sum(abs(float(row["moved_mm"]) - MOVED_MM) < 0.01 for row in rows)
    error = sorted(float(row[way + "_mm"]) for row in judged if row[way + "_mm"])
    return judged, error, doubt


def compare(where, result, rows, way):
    judged, error, doubt = numbers_of(rows, way)
    wrong = []
    if abs(result["points"] - len(judged)) > doubt:
        wrong.append(f"{where}: {way}: {result['points']} points, not {len(judged)}")
    if doubt or not error:
        return wrong
    want = {"median_mm": error[len(error) // 2], "p90_mm": error[int(0.9 * (len(error) - 1))], "worst_mm": error[-1]}
    wrong += [f"{where}: {way}: {key} {result[key]}, not {value}" for key, value in want.items()
              if abs(result[key] - value) > 0.006]
    if abs(result["answered"] - len(error) / len(judged)) > 1e-9:
        wrong.append(f"{where}: {way}: answered {result['answered']}")
    return wrong


def check_correspondence(folder):
    study = json.load(open(folder + "/study.json"))
    rows = list(csv.DictReader(open(folder + "/errors.csv")))
    wrong, nchecked = [], 0
    for way, result in study["all"].items():
        wrong += compare("all", result, rows, way)
    fold = set()
    for k, case in enumerate(study["cases"], 1):
        own = [row for row in rows if row["case"] == str(k)]
        if len(own) != case["scan_points"]:
            wrong.append(f"{case['case']}: {case['scan_points']} points, not {len(own)}")
        if case["case"].startswith("fold 135") and case["attachments"] == "right":
            fold.add(str(k))
        for way, result in case["ways"].items():
            wrong += compare(case["case"], result, own, way)
            nchecked += 1
    for way, result in study["fold_135_right"].items():
        wrong += compare("fold 135", result, [row for row in rows if row["case"] in fold], way)
    if nchecked < 8:
        wrong.append(f"only {nchecked} numbers")
    return wrong


def median(values):
    v = sorted(values)
    return (v[(len(v) - 1) // 2] + v[len(v) // 2]) / 2


def scores_of(rows):
    true = sum(row["true"] == "1" for row in rows)
    found = sum(row["attached"] == "1" for row in rows)
    both = sum(row["true"] == "1" and row["attached"] == "1" for row in rows)
    return 2 * both / (true + found), both / true


def check_attachments(folder):
    study = json.load(open(folder + "/study.json"))
    rows = list(csv.DictReader(open(folder + "/vertices.csv")))
    wrong, scores = [], {"single": [], "three": []}
    for k, layout in enumerate(study["layouts"], 1):
        for view, update in zip(("1", "2", "3", "all"), layout["updates"]):
            own = [row for row in rows if row["layout"] == str(k) and row["views"] == view]
            dsc, tpr = scores_of(own)
            scores["three" if view == "all" else "single"].append((dsc, tpr))
            if abs(dsc - update["dsc"]) > 1e-9 or abs(tpr - update["tpr"]) > 1e-9:
                wrong.append(f"layout {k}, view {view}: {update['dsc']}, {update['tpr']}, not {dsc}, {tpr}")
            if not update["is_accepted"] and dsc > 0:
                wrong.append(f"layout {k}, view {view}: refused, but with attachments")
    for name, pairs in scores.items():
        if name not in study["by"]:
            continue
        by = study["by"][name]
        if by["n"] != len(pairs):
            wrong.append(f"{name}: {by['n']} updates, not {len(pairs)}")
        for i, key in enumerate(("dsc", "tpr")):
            want = median([pair[i] for pair in pairs])
            if abs(by[key][1] - want) > 1e-9:
                wrong.append(f"{name}: {key} {by[key][1]}, not {want}")
    return wrong


def check_simulated(folder):
    study = json.load(open(folder + "/study.json"))
    rows = [row for row in csv.DictReader(open(folder + "/samples.csv")) if row["made"] == "1"]
    wrong, nchecked = [], 0
    for name in ("exact", "camera", "board", "two"):
        for guess in ("zero", "all", "same", "net"):
            own = [row for row in rows if row["set"] == name and row["guess"] == guess]
            for key, part in ((guess, own), (guess + "_hidden", [row for row in own if float(row["visible"]) < 0.5])):
                result = study[name][key]
                moved = [row for row in part if row["simulated"] == "1"]
                if result["n"] != len(part) or result["simulated"] != len(moved):
                    wrong.append(f"{name}: {key}: {result['n']} samples, not {len(part)}")
                if result["stopped"] != sum(float(row["load"]) < 1 for row in moved):
                    wrong.append(f"{name}: {key}: {result['stopped']} stopped")
                for column, of in (("dsc", part), ("tpr", part), ("dsc_area", part), ("ave_mm", moved), ("mve_mm", moved)):
                    if of:
                        nchecked += 1
                        want = median([float(row[column]) for row in of])
                        if abs(result[column][1] - want) > 2e-5:
                            wrong.append(f"{name}: {key}: {column} {result[column][1]}, not {want}")
    if nchecked < 30:
        wrong.append(f"only {nchecked} numbers")
    return wrong


CAUSE = {"shift": "moved", "tilt": "moved", "aim": "moved", "missing": "empty", "other": "unknown"}


def check_trust(folder):
    study = json.load(open(folder + "/study.json"))
    rows = list(csv.DictReader(open(folder + "/cases.csv")))
    part = {name: [row for row in rows if row["part"] == name] for name in ("right", "wrong", "two")}

    def count(of, key, value):
        return sum(row[key] == value for row in of)

    def check(where, got, want):
        return [] if abs(got - want) < 2e-6 else [f"{where}: {got}, not {want}"]

    wrong = []
    for name in part:
        wrong += check(name, study[name], len(part[name]))
        wrong += check(name + "_refused", study[name + "_refused"], count(part[name], "accepted", "0"))
    for name, kind in study["kinds"].items():
        own = [row for row in part["wrong"] if row["error"] == name]
        used = [row for row in own if row["accepted"] == "1"]
        left = [row for row in own if row["accepted"] == "0"]
        wrong += check(name, kind["cases"], len(own))
        wrong += check(name + " accepted", kind["accepted"], count(used, "corrected", "0"))
        wrong += check(name + " corrected", kind["corrected"], count(used, "corrected", "1"))
        wrong += check(name + " refused", kind["refused"], len(left))
        wrong += check(name + " right cause", kind["right_cause"], count(left, "cause", CAUSE.get(name, name)))
        if used:
            wrong += check(name + " dice", kind["dice"], median([float(row["dice"]) for row in used]))
            wrong += check(name + " right dice", kind["dice_right"], median([float(row["dice_right"]) for row in used]))
    for key, of in (("bad", part["wrong"]), ("two_bad", part["two"])):
        lost = sum(row["accepted"] == "1" and float(row["dice_right"]) - float(row["dice"]) > 0.15 for row in of)
        wrong += check(key, study[key], lost)
    wrong += check("two_out", study["two_out"], sum(row["accepted"] == "0" or row["left_out"] == "1" for row in part["two"]))
    for key in ("probability", "probability_right", "probability_with_refused"):
        bins = study[key]["bins"]
        n = sum(bin["vertices"] for bin in bins)
        ece = sum(bin["vertices"] * abs(bin["probability"] - bin["attached"]) for bin in bins) / n
        wrong += check(key, study[key]["vertices"], n) + check(key + " ece", study[key]["ece"], ece)
    return wrong


def main():
    checks = {"attachments": check_attachments, "correspondence": check_correspondence, "simulated": check_simulated, "trust": check_trust}
    wrong = checks[sys.argv[1]](sys.argv[2])
    print("\n".join(wrong) if wrong else "every number agrees")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

"""Run one file of tests with pytest; exit 77, which CTest reports as skipped, where pytest or NumPy is missing.

The Python is that of build/python, where tools/python_env.sh made it, else the one that runs this file.
"""
import importlib.util
import os
import pathlib
import resource
import subprocess
import sys

own = pathlib.Path(__file__).resolve().parents[2] / "build/python/bin/python3"
if own.exists() and not os.environ.get("OM_TEST_OWN"):
    os.environ["OM_TEST_OWN"] = "1"
    os.execv(own, [str(own), "-B", *sys.argv])

missing = [name for name in ("numpy", "pytest") if importlib.util.find_spec(name) is None]
if missing:
    print(f"skipped: python3 cannot import {' and '.join(missing)}")
    sys.exit(77)
limit = int(os.environ.get("OM_TEST_CPU_S", "0"))
if limit:  # processor time, as the tests in C
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 10))
environment = {"OPENBLAS_NUM_THREADS": "1", **os.environ}  # of NumPy: its threads spin beside those of the library
if environment.get("OM_TEST_PRELOAD"):
    environment["LD_PRELOAD"] = environment["OM_TEST_PRELOAD"]
    environment["ASAN_OPTIONS"] = "detect_leaks=0"  # Python itself leaks; the tests count blocks of the library
sys.exit(subprocess.run([sys.executable, "-B", "-m", "pytest", "-q", "-p", "no:cacheprovider", "-ra", *sys.argv[1:]],
                        env=environment, check=False).returncode)

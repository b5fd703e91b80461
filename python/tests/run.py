"""Run one file of tests with pytest; exit 77, which CTest reports as skipped, where pytest or NumPy is missing.

The Python is that of build/python, where tools/python_env.sh made it, else the one that runs this file.
"""
import importlib.util
import os
import pathlib
import resource
import sys


def main():
    own = pathlib.Path(__file__).resolve().parents[2] / "build/python/bin/python3"
    python = str(own) if own.exists() else sys.executable
    preload = os.environ.get("OM_TEST_PRELOAD")
    if not os.environ.get("OM_TEST_OWN") and (preload or own.exists()):
        os.environ["OM_TEST_OWN"] = "1"
        if preload:
            os.environ["LD_PRELOAD"] = preload
            os.environ["ASAN_OPTIONS"] = "detect_leaks=0"  # Python itself leaks; the tests count blocks of the library
        os.execv(python, [python, "-B", *sys.argv])

    missing = [name for name in ("numpy", "pytest") if importlib.util.find_spec(name) is None]
    if missing:
        print(f"skipped: python3 cannot import {' and '.join(missing)}")
        return 77
    limit = int(os.environ.get("OM_TEST_CPU_S", "0"))
    if limit:  # processor time, as the tests in C
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 10))
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of NumPy: its threads spin beside those of the library
    import pytest
    # a sanitizer writes why it ends the process past Python: pytest would keep that to itself
    capture = ["--capture=sys"] if os.environ.get("OM_TEST_PRELOAD") else []
    return pytest.main(["-q", "-p", "no:cacheprovider", "-ra", *capture, *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())

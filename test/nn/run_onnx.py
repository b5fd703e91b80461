#!/usr/bin/env python3
"""Run every NAME.onnx of a folder in onnxruntime on NAME.in and compare with NAME.out (raw floats).

    run_onnx.py FOLDER     exit 0; 1 where outputs differ by more than 1e-4; 77 without onnxruntime
"""
import pathlib
import sys

try:
    import numpy
    import onnxruntime
except ImportError as missing:
    print(f"skip: {missing}")
    sys.exit(77)

failed = 0
for model in sorted(pathlib.Path(sys.argv[1]).glob("*.onnx")):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(model), options, providers=["CPUExecutionProvider"])
    shape = session.get_inputs()[0].shape[1:]
    values = numpy.fromfile(model.with_suffix(".in"), numpy.float32).reshape(-1, *shape)
    expected = numpy.fromfile(model.with_suffix(".out"), numpy.float32)
    found = session.run(["output"], {"input": values})[0]
    if list(found.shape[1:]) != session.get_outputs()[0].shape[1:] or found.size != expected.size:
        print(f"{model.name}: shape {found.shape}, {expected.size} values are expected")
        failed += 1
        continue
    error = float(numpy.abs(found.ravel() - expected).max())
    print(f"{model.name}: largest difference {error:.2g} of {float(numpy.abs(expected).max()):.2g}")
    failed += not error <= 1e-4
sys.exit(1 if failed else 0)

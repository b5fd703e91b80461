# omentum umesh predict: files, answers, and one sentence for whatever goes wrong.
$ omentum umesh generate --elements 200 --points 8x8x8 -n 8 -q -o data && $OMENTUM umesh train -d data -o net --levels 1 --epochs 1 --validation 2 -q > /dev/null
exit 0

$ omentum umesh predict -w net/weights.safetensors --press 5 --onnx /dev/full; code=$?; test -c /dev/full && exit $code
exit 3
err /dev/full: cannot write: No space left on device
$ for f in a.vtu a.vtk a.onnx; do echo mine > $f; done; omentum umesh predict -w net/weights.safetensors --press 5 -o a.vtu; a=$?; $OMENTUM umesh predict -w net/weights.safetensors --press 5 -o a.vtk; b=$?; $OMENTUM umesh predict -w net/weights.safetensors --press 5 --onnx a.onnx; echo $a $b $?; cat a.vtu a.vtk a.onnx | uniq -c
exit 0
out ^3 3 3$
out ^ *3 mine$
$ for i in 1 2; do $OMENTUM umesh predict -w net/weights.safetensors --press 5 -o b.vtu --onnx b.onnx || exit; $OMENTUM umesh predict -w net/weights.safetensors --press 5 -o b.vtk || exit; done
exit 0
file b.vtk
$ omentum umesh predict -w net/weights.safetensors --press 5 -o b.vtu --onnx net/weights.safetensors
exit 3
err net/weights\.safetensors is an input

$ omentum umesh predict -w net/weights.safetensors --press 5 --point 0,0,30 -o pressed.vtu --onnx net.onnx
exit 0
out ^probe at
out ^point \(0,0,30\) mm moves by
out within the range of the training
file pressed.vtu
file net.onnx

# relaxation ends at 0.586 mm after 100 cycles in the release build, and with an inverted element under the sanitizers.
# Twice as deep as anything that was trained: told.
$ omentum umesh predict -w net/weights.safetensors --press 120
exit 1
out ^OUTSIDE the range of the training

$ omentum umesh predict -w net/metrics.csv
exit 3
err metrics.csv
err-lines 1

$ omentum umesh predict -w net/weights.safetensors --point 1,2
exit 3
err three numbers

# Figures for programs; --name=value.
$ omentum umesh predict -w net/weights.safetensors --press=5 --tolerance=0.05 --point=0,0,30 --json
exit 0
out "nodes": [1-9]\d+
out "prediction_ms": [0-9.]+
out "point.0.z": -?[0-9]
err a prediction:
$ omentum umesh predict -w net/weights.safetensors --at=20,0,7x
exit 3
err 20,0,7x

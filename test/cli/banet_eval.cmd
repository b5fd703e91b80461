# omentum banet eval: once more, into the same folder.
$ $OMENTUM banet generate -n 1 --shard 1 --seed 905 --way exact --pictures 0 -q -o data > /dev/null; for k in 1 2; do $OMENTUM banet eval -d data -w $ROOT/weights/banet.safetensors -q -o out > /dev/null || exit; done; ls out
exit 0
out ^eval\.json$
out ^samples\.csv$

# What the network was trained on is printed; samples of another tissue get a note, voxels of twice the size are refused.
$ omentum banet eval -d data -q
exit 0
out ^network: voxel 4\.688 mm, side 300 mm, generator omentum banet 3, way mixed, law neo-hookean, element quadratic, data 9029c3210d7a017e$
no-err
$ $OMENTUM banet generate -n 1 --shard 1 --seed 905 --way exact --element linear --pictures 0 -q -o stiff > /dev/null; omentum banet eval -d stiff -q
exit 0
out ^note: the network: trained on quadratic elements, used with linear ones: judged on another tissue$
no-err
$ $OMENTUM banet generate -n 1 --shard 1 --seed 905 --way exact --side 700 --pictures 0 -q -o wide > /dev/null; omentum banet eval -d wide -q
exit 3
err trained on voxels of 4\.69 mm \(a grid of 300 mm\) and is used with 10\.9 mm \(700 mm\)
err-lines 1

# omentum banet eval: once more, into the same folder.
$ $OMENTUM banet generate -n 1 --shard 1 --seed 905 --way exact --pictures 0 -q -o data > /dev/null; for k in 1 2; do $OMENTUM banet eval -d data -w $ROOT/weights/banet.safetensors -q -o out > /dev/null || exit; done; ls out
exit 0
out ^eval\.json$
out ^samples\.csv$

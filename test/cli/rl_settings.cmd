# omentum rl eval: the settings of a policy's training are those of its use, or are named.
$ omentum rl train -t reach -s step=0.1 -n 1024 -q -o file > /dev/null && ls file/policy.safetensors
exit 0
out policy

# A policy states its settings: they are the defaults of an evaluation, and others are named; an older file does not.
$ omentum rl eval -p file/policy.safetensors -q -n 2
exit 1
out ^2 episodes: reached 0\.000, .* 40\.0 steps$
no-err
$ omentum rl eval -t reach -p file/policy.safetensors -s step=0.05 -q -n 2
exit 1
out 80\.0 steps$
err ^warning: file/policy\.safetensors was trained with other settings: step 0\.1 \(here 0\.05\), max_step 40 \(here 80\)$
err-lines 1
$ omentum rl eval -p $ROOT/weights/approach.safetensors -q -n 2
exit 0
out ^note: .*approach\.safetensors: the settings of its training: not stated$
no-err
$ $OMENTUM rl train -t reach -s step=0.05 --start file/policy.safetensors -n 1024 -q -o further > /dev/null && omentum rl eval -p further/policy.safetensors -q -n 2
exit 1
out 80\.0 steps$
no-err

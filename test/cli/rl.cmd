# omentum rl: demonstrations, training, evaluation; every bad input has a sentence.
$ omentum rl demo -t reach -n 6 -q -o demos.hdf5
exit 0
out ^6 demonstrations, [0-9]+ steps, mean score 1.000: demos.hdf5$
no-err
$ omentum rl train -t reach -n 2048 -q -o ppo --json
exit 0
out "steps": 2048,
$ ls ppo
exit 0
out ^checkpoint.h5$
out ^metrics.csv$
out ^policy.onnx$
out ^policy.safetensors$
out ^report.html$
$ wc -l < ppo/metrics.csv; grep -c "rl train -t reach -n 2048" ppo/report.html; grep -oE "The mean score .*: the target [0-9.]+ is (not )?reached|No episode has ended yet" ppo/report.html
exit 0
out ^3$
out ^1$
out ^The mean score in the last 100 episodes is [0-9.-]+: the target [0-9.]+ is not reached$
$ omentum rl train -t reach -m gail -d demos.hdf5 -n 1024 --clone-epochs 2 -q -o gail
exit 0
out ^1024 steps
# Drawn starts: another number of episodes, and other starts than those of the evaluation.
$ omentum rl eval -t reach --expert --drawn -q
exit 0
out ^100 episodes: reached 1\.000
$ $OMENTUM rl eval -t reach --expert --drawn -n 27 -q > drawn; $OMENTUM rl eval -t reach --expert -n 27 -q > starts; cut -c1-26 drawn starts; cmp -s drawn starts || echo others
exit 0
out ^27 episodes: reached 1\.00
out ^27 episodes: reached 1\.00
out ^others$
$ omentum rl eval -t cart-pole --random -q
exit 1
out ^100 episodes: return [0-9.]+, lowest
# Options from a file: the same policy as with them on the command line, which is stronger.
write options.yaml
    task: reach
    set:
      - {key: step, value: 0.1}
    steps: 4096
    environments: 8
    gail-actions: false
    quiet: true
$ $OMENTUM rl train -c options.yaml -n 1024 -o file > /dev/null && $OMENTUM rl train -t reach -s step=0.1 -n 1024 --environments 8 -q -o words > /dev/null && tail -c 20000 file/policy.safetensors | cksum > a && tail -c 20000 words/policy.safetensors | cksum | cmp - a && echo same
exit 0
out ^same$
$ echo 'stepps: 3' > bad.yaml; $OMENTUM rl train -t reach -c bad.yaml -o x
exit 2
err bad.yaml.*steps
$ echo 'quiet: maybe' > bad.yaml; $OMENTUM rl train -t reach -c bad.yaml -o x
exit 2
err must be true or false
# Evaluations: the best policy is kept, also where the training is killed; a stop after perfect evaluations.
$ omentum rl train -t reach -s step=0.1 -n 8192 --eval-period 2 --eval-set step=0.05 --eval-episodes 8 -q -o best --json
exit 0
out "kept_step": [0-9]+,
out "eval_score": [0-9.]+,
$ head -1 best/metrics.csv; cut -d, -f14 best/metrics.csv | grep -c "[0-9]"; grep -c "most probable actions" best/report.html
exit 0
out ,eval_score,eval_return,eval_least,seconds$
out ^4$
out ^[1-9]
write evaluated.yaml
    task: reach
    steps: 2048
    eval-period: 1
    eval-set:
      - {key: step, value: 0.1}
    quiet: true
$ $OMENTUM rl train -c evaluated.yaml -o file2 > /dev/null && $OMENTUM rl train -t reach -n 2048 --eval-period 1 --eval-set step=0.1 -q -o words2 > /dev/null && tail -c 20000 file2/policy.safetensors | cksum > a && tail -c 20000 words2/policy.safetensors | cksum | cmp - a && echo same
exit 0
out ^same$
$ omentum rl train -t reach --eval-stop 2 -o x
exit 2
err --eval-stop has no effect without evaluations; give --eval-period N
$ omentum rl train -t reach --sharpness 0 -o x
exit 2
err --sharpness
$ omentum rl train -t reach --eval-period 2 --eval-set stop=2 -o x
exit 2
err did you mean step\?
# Demonstrations of other moves.
$ omentum rl train -t reach -s step=0.1 -m gail -d demos.hdf5 -n 1024 -q -o x
exit 3
err the demonstrations have the settings step=0.05, the task has step=0.1
# bad input
$ omentum rl train -t reach -n 2048 --gamma 0.9 -q -o ppo
exit 3
err other settings
$ omentum rl train -t rech -o x
exit 2
err did you mean reach\?
$ omentum rl train -t reach -s stop=1 -o x
exit 2
err did you mean step\?
$ omentum rl train -t reach -s step -o x
exit 2
err write KEY=VALUE
$ omentum rl train -t reach -m pp -o x
exit 2
err give ppo, gail or clone
$ omentum rl train -t reach -m gail -o x
exit 2
err gail needs demonstrations
$ omentum rl train -t reach
exit 2
err give the folder
$ omentum rl eval -t cart-pole -p ppo/policy.safetensors
exit 3
err the policy is of task reach, not of cart-pole
$ omentum rl eval -t reach
exit 2
err give a policy
$ omentum rl train -t list
exit 0
out ^cart-pole
# Exposure by grasping place.
$ omentum rl survey -t reach
exit 3
err needs a task made by om_rl_retract_create

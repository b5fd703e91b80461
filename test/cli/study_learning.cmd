# omentum study learning, logic alone: two seeds of PPO and cloning on the task "reach", too short to learn it. The slow
# study_learning_full.cmd learns it.
$ omentum study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 2048 --no-reality -q -o out
exit 1
out ^ppo +0\.[0-9]+ +0\.[0-9]+ +-
out ^clone +[01]\.[0-9]+
out ^criteria: missed: ppo: mean of a seed 0\.[0-9]+, bound 0\.95; ppo: lowest start [0-9.]+, bound 0\.80$
no-err
$ ls out
exit 0
out ^clone-1$
out ^clone-2-training.csv$
out ^demos.hdf5$
out ^ppo-1$
out ^ppo-2-training.csv$
out ^report.html$
out ^study.json$
# Finished trainings and evaluations are kept: the same numbers again.
$ cp out/study.json first.json && $OMENTUM study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 2048 --no-reality -q -o out > /dev/null; grep -v seconds first.json > a; grep -v seconds out/study.json | cmp - a && echo same
exit 0
out ^same$
# A score that was changed by hand is used only with the policy of its line.
$ sed -i '1s/.*/# policy 0/;2s/.*/0.5/' out/ppo-1-training.csv && $OMENTUM study learning -t reach --same-task --learners ppo,clone --seeds 2 -n 2048 --no-reality -q -o out > /dev/null; grep -v seconds out/study.json | cmp - a && echo same
exit 0
out ^same$
# PPO in two parts: the second one begins with the policy of the first one, kept in a folder of its own.
$ omentum study learning -t reach --same-task --learners ppo --seeds 1 -n 2048 --varied-steps 2048 --no-reality -q -o two; code=$?; ls two; exit $code
exit 1
out ^ppo +0\.[0-9]+ +0\.[0-9]+ +-
out ^ppo-1$
out ^ppo-1-plain$
# A task without "reality" says so.
$ omentum study learning -t reach --same-task --learners clone --seeds 1 -q -o none
exit 3
err reach has no setting "world"
$ omentum study learning -t reach --learners ppo,bc -o x
exit 2
err no learner bc
$ omentum study learning -t reach --learners ppo-thesis -o x
exit 3
err reach
$ omentum study learning
exit 2
err no output folder

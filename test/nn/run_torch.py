#!/usr/bin/env python3
"""Print what PyTorch's optimisers make of the steps of test_nn_optim.c: a line of 16 weights for each case.

Exit 77 without PyTorch.
"""
import math
import sys

try:
    import torch
except ImportError as missing:
    print(f"skip: {missing}")
    sys.exit(77)

NSTEP = 40
torch.set_num_threads(1)


def train(kind, decay, clip):
    weight = torch.nn.Parameter(torch.tensor([math.cos(k) for k in range(12)], dtype=torch.float32))
    bias = torch.nn.Parameter(torch.tensor([math.cos(k) for k in range(12, 16)], dtype=torch.float32))
    optimiser = kind([{"params": [weight], "weight_decay": decay}, {"params": [bias], "weight_decay": 0}], lr=0.1)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, max_lr=0.1, total_steps=NSTEP, cycle_momentum=False)
    for t in range(NSTEP):
        grad = torch.tensor([math.sin(1.7 * t + 2.3 * k) * (1 + 0.1 * k) for k in range(16)], dtype=torch.float32)
        weight.grad, bias.grad = grad[:12].clone(), grad[12:].clone()
        if clip > 0:
            torch.nn.utils.clip_grad_norm_([weight, bias], clip)
        optimiser.step()
        schedule.step()
    print(" ".join(f"{v:.9g}" for v in weight.tolist() + bias.tolist()))


train(torch.optim.Adam, 0.1, 0)
train(torch.optim.AdamW, 0.5, 0)
train(torch.optim.AdamW, 0.01, 0.5)

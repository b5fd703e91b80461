#!/usr/bin/env python3
"""Time the U-Net of `omentum_bench nn` beside PyTorch and OpenVINO, each at its best, on this machine.

    tools/bench_peers.py [--bench build/release/bin/omentum_bench] [--rounds 5] [--json]

One core, processor time, the programs in turns; the smallest time of all rounds counts. Of PyTorch the fastest of
plain, channels-last and compiled layouts is taken, of OpenVINO its latency mode. Compiled forward passes are frozen:
without it PyTorch 2.15 takes its slow convolutions in float for a batch of one (6 times as long). The network is built here from the
layers that `om_unet_create` documents; its number of parameters must be that of the bench's row. Needs the
Python packages torch and openvino where they are to be compared; what cannot be imported is left out by name.
The times of PyTorch in `bench_nn.c` come from here.
"""
import argparse
import json
import os
import subprocess
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"

GRID, INPUTS, OUTPUTS, LEVELS, BATCH = (16, 24, 32), 3, 3, 3, 4
CASES = [(base, kind, work) for base in (16, 64) for work in ("forward", "training") for kind in ("f32", "bf16")]


def bench_rows(program, base):
    """Smallest time in ms and size by (type, work), of the bench in one core's processor time."""
    command = [program, "--processor", "--workers", "1", "--runs", "1", "nn"] + (["--quick"] if base == 16 else [])
    rows = {}
    for line in subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines():
        row = json.loads(line)
        if f" {base} channels" in row["scene"]:
            key = (row["scene"].split(", ")[-1], "training" if "training" in row["work"] else "forward")
            rows[key] = (row["min_ms"], row["size"])
    return rows


def make_unet(torch, base):
    nn = torch.nn

    def stages(inputs, outputs):
        return nn.Sequential(nn.Conv3d(inputs, outputs, 3, padding=1), nn.ReLU(),
                             nn.Conv3d(outputs, outputs, 3, padding=1), nn.ReLU())

    class Unet(nn.Module):
        def __init__(self):
            super().__init__()
            width = [base << k for k in range(LEVELS + 1)]
            self.down = nn.ModuleList(stages(INPUTS if k == 0 else width[k - 1], width[k]) for k in range(LEVELS))
            self.bottom = stages(width[LEVELS - 1], width[LEVELS])
            self.rise = nn.ModuleList(nn.ConvTranspose3d(width[k + 1], width[k], 2, stride=2) for k in range(LEVELS))
            self.up = nn.ModuleList(stages(2 * width[k], width[k]) for k in range(LEVELS))
            self.head = nn.Conv3d(base, OUTPUTS, 1)

        def forward(self, x):
            skipped = []
            for stage in self.down:
                x = stage(x)
                skipped.append(x)
                x = nn.functional.max_pool3d(x, 2)
            x = self.bottom(x)
            for k in reversed(range(LEVELS)):
                x = self.up[k](torch.cat([skipped[k], self.rise[k](x)], 1))
            return self.head(x)

    torch.manual_seed(1)
    return Unet()


def min_ms(call, warm, calls):
    for _ in range(warm):
        call()
    best = float("inf")
    for _ in range(calls):
        begin = time.process_time()
        call()
        best = min(best, 1e3 * (time.process_time() - begin))
    return best


def torch_calls(torch, base, kind, work):
    """(layout, call) of every layout that may be the fastest for this case."""
    dtype = torch.float32 if kind == "f32" else torch.bfloat16
    torch._dynamo.reset()
    torch._inductor.config.freezing = work == "forward"
    calls = []
    for layout in ("plain", "channels last", "compiled", "compiled, channels last"):
        net = make_unet(torch, base)
        x = torch.randn((1 if work == "forward" else BATCH, INPUTS) + GRID)
        if "last" in layout:
            net, x = net.to(memory_format=torch.channels_last_3d), x.to(memory_format=torch.channels_last_3d)
        if work == "forward":
            net, x = net.eval().to(dtype), x.to(dtype)
            run = torch.compile(net) if "compiled" in layout else net

            def call(run=run, x=x):
                with torch.no_grad():
                    run(x)
        else:
            optimiser = torch.optim.Adam(net.parameters(), 1e-4, fused=True)
            run = torch.compile(net) if "compiled" in layout else net
            target = torch.randn((BATCH, OUTPUTS) + GRID)

            def call(run=run, x=x, target=target, optimiser=optimiser):
                optimiser.zero_grad(set_to_none=True)
                with torch.autocast("cpu", torch.bfloat16, enabled=kind == "bf16"):
                    y = run(x)
                torch.nn.functional.mse_loss(y.float(), target).backward()
                optimiser.step()
        calls.append((layout, call))
    return calls


def openvino_call(torch, openvino, base, kind):
    net = make_unet(torch, base).eval()
    x = torch.randn((1, INPUTS) + GRID)
    core = openvino.Core()
    model = openvino.convert_model(net, example_input=x, input=[x.shape])
    compiled = core.compile_model(model, "CPU", {"PERFORMANCE_HINT": "LATENCY", "INFERENCE_NUM_THREADS": 1,
                                                 "INFERENCE_PRECISION_HINT": kind})
    request, value = compiled.create_infer_request(), x.numpy()
    return lambda: request.infer([value], share_inputs=True)


def try_import(name):
    try:
        return __import__(name)
    except ImportError:
        print(f"{name} cannot be imported: left out", file=sys.stderr)
        return None


def peers_of(torch, openvino, case):
    """[(name, call)] of a case; a way that this machine cannot run is left out by name."""
    base, kind, work = case
    calls = [(f"PyTorch {torch.__version__.split('+')[0]}", layout, call)
             for layout, call in torch_calls(torch, base, kind, work)]
    if openvino and work == "forward":
        version = openvino.__version__.split("-")[0]
        calls.append((f"OpenVINO {version}", "latency", openvino_call(torch, openvino, base, kind)))
    good = []
    for name, layout, call in calls:
        try:
            call()
            good.append((name, layout, call))
        except Exception as error:  # of a compiler or a missing instruction: the other ways stay
            print(f"{name}, {layout}: {str(error).splitlines()[0]}: left out", file=sys.stderr)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bench", default="build/release/bin/omentum_bench")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--work", choices=("forward", "training"), help="default: both")
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    args = parser.parse_args()
    torch, openvino = try_import("torch"), try_import("openvino")
    if not torch:
        sys.exit("bench_peers: nothing to compare with; install torch")
    import torch._inductor.config  # not loaded by torch itself
    torch.set_num_threads(1)
    for case in CASES:
        base, kind, work = case
        if args.work not in (None, work):
            continue
        peers, best, ours, size = peers_of(torch, openvino, case), {}, float("inf"), 0
        for _ in range(args.rounds):
            row = bench_rows(args.bench, base).get((kind, work))
            if not row:
                break
            ours, size = min(ours, row[0]), row[1]
            for name, layout, call in peers:
                ms = min_ms(call, 2, 5 if base == 64 else 20)
                if ms < best.get(name, (float("inf"), ""))[0]:
                    best[name] = (ms, layout)
        if not size:
            print(f"{base} channels, {kind}, {work}: this machine has no such type")
            continue
        parameters = sum(p.numel() for p in make_unet(torch, base).parameters())
        if parameters != size:
            sys.exit(f"bench_peers: the network here has {parameters} parameters, the bench's {size}")
        for name, (ms, layout) in best.items():
            if args.json:
                print(json.dumps({"channels": base, "type": kind, "work": work, "omentum_ms": round(ours, 3),
                                  "peer": name, "layout": layout, "peer_ms": round(ms, 3),
                                  "ratio": round(ms / ours, 2)}), flush=True)
            else:
                print(f"{base} channels, {kind}, {work}: omentum {ours:.2f} ms, {name} ({layout}) {ms:.2f} ms, "
                      f"ratio {ms / ours:.2f}", flush=True)


if __name__ == "__main__":
    main()

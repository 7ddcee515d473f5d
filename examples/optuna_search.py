"""Tunes the tracker's settings with Optuna. Requires `pip install optuna`, and skiagraph on the PATH.

    python3 examples/optuna_search.py scenarios/walk.toml
"""
import json, subprocess, sys
import optuna

def error(trial):
    params = {"particles": trial.suggest_int("particles", 10, 200, log=True), "survival_rate": trial.suggest_float("survival_rate", 0.1, 0.9)}
    command = ["skiagraph", "run", sys.argv[1], "--params-json", "-", "--json", "--quiet", "--seeds", "3", "--out", f"runs/optuna-{trial.number}"]
    done = subprocess.run(command, input=json.dumps(params), capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["metrics"]["humaneva_mm"]["mean"]

study = optuna.create_study(direction="minimize")
study.optimize(error, n_trials=int(sys.argv[2]) if len(sys.argv) > 2 else 20)
print(study.best_params, study.best_value)

# %% [markdown]
# # A paper's analysis from its CSV files, in ten lines
#
# Fourteen people said which way a gun shot, and how much they liked three ways of rendering it. The logs here are those
# of synthetic participants, so that this page runs anywhere; with your own, leave the next cell out.

# %%
import recoil

people = [f"P{number:02d}" for number in range(1, 15)]
for name in ("direction", "preference"):
    recoil.run_synthetic(recoil.load_config(name), people, "results", seed=1)

# %% [markdown]
# The analysis: means with their within-subject intervals, the repeated-measures ANOVA, Tukey's tests with its error
# term, and exact binomial tests against guessing.

# %%
study = recoil.analyze("results")
print(f"Data: {study.data_kind}.")
print(study.to_frame().round(3).to_string(index=False))
for name, found in study.analysed.items():
    anova = found.anova
    print(f"{name}: F({anova.df[0]}, {anova.df[1]}) = {anova.F:.2f}, p = {anova.p:.3g}")
    for pair in found.tukey:
        print(f"  {pair.a} - {pair.b}: {pair.difference:.3f}, p = {pair.p:.3g}")
for method, tests in study.direction.binomial.items():
    print(f"{method}, forward: {tests['forward'].successes} of {tests['forward'].trials}, p = {tests['forward'].p:.3g}")

# %% [markdown]
# Everything else (effect sizes, sphericity, sensitivity, response times) is in `study.to_dict()`, which is what
# `recoil analyze results --out analysis` writes as `statistics.json`, beside a report with figures.

# %% [markdown]
# It prints:
#
#     Data: synthetic.
#     experiment       method  n  mean    sd  ci_low  ci_high
#      direction    vibration 14 0.507 0.216   0.431    0.584
#      direction asymmetric-1 14 0.736 0.174   0.660    0.811
#      direction asymmetric-2 14 0.886 0.135   0.825    0.946
#     preference    vibration 14 2.321 1.610   1.206    3.437
#     preference asymmetric-1 14 5.800 1.936   4.966    6.634
#     preference asymmetric-2 14 7.279 1.731   6.326    8.231
#     direction: F(2, 26) = 33.43, p = 6.5e-08
#       asymmetric-1 - vibration: 0.229, p = 0.000125
#       asymmetric-2 - vibration: 0.379, p = 3.96e-08
#       asymmetric-2 - asymmetric-1: 0.150, p = 0.00936
#     preference: F(2, 26) = 31.86, p = 1.02e-07
#       asymmetric-1 - vibration: 3.479, p = 2.95e-05
#       asymmetric-2 - vibration: 4.957, p = 8.89e-08
#       asymmetric-2 - asymmetric-1: 1.479, p = 0.0708
#     vibration, forward: 71 of 140, p = 0.933
#     asymmetric-1, forward: 103 of 140, p = 2.18e-08
#     asymmetric-2, forward: 124 of 140, p = 7.02e-22

# %% [markdown]
# # Another lab's logs, by a column map
#
# Eight people, two ways of rendering, a semicolon between cells, times in ms, codes such as VP_01. The answers are made
# up here; your own files need this map alone.

# %%
import csv
import random
from pathlib import Path

import recoil

draw = random.Random(7)
with open("lab.csv", "w", newline="") as file:
    table = csv.writer(file, delimiter=";")
    table.writerow(["Person", "Reiz", "Richtung", "Taste", "RT"])
    for person in range(1, 9):
        for stimulus, right in (("stark", 0.9), ("schwach", 0.6)):
            for trial in range(20):
                way, other = ("vh", "hv")[trial % 2]
                key = way if draw.random() < right else other
                table.writerow([f"VP_{person:02d}", stimulus, way, key, draw.randint(350, 900)])

# %% [markdown]
# The map says which column means what, and what the cells mean; `configs/examples/columns.toml` shows every key.

# %%
Path("map.toml").write_text(r"""
experiment = "direction"

[text]
delimiter = ";"

[participant]
column = "Person"
pattern = "VP_(\\d+)"

[columns]
method = "Reiz"
direction = "Richtung"
response = "Taste"
response_time = "RT"

[response_time]
unit = "ms"

[values.method]
stark = "strong"
schwach = "weak"

[values.direction]
v = "forward"
h = "backward"

[values.response]
v = "forward"
h = "backward"
""")

# %%
logs = recoil.read_logs("lab.csv", columns="map.toml")
print(logs.trials[["participant_id", "method", "direction", "response", "response_time_s"]].head(3).to_string())
found = recoil.analyze("lab.csv", columns="map.toml")
print(found.to_frame().round(3).to_string(index=False))
anova = found.direction.anova
print(f"F({anova.df[0]}, {anova.df[1]}) = {anova.F:.2f}, p = {anova.p:.3g}")

# %% [markdown]
# On the command line: `recoil analyze lab.csv --columns map.toml --out analysis`, and the same option for `fit times`
# and `export bids`.

# %% [markdown]
# It prints:
#
#       participant_id  method direction  response  response_time_s
#     0             01  strong   forward   forward            0.504
#     1             01  strong  backward  backward            0.399
#     2             01  strong   forward   forward            0.898
#     experiment method  n  mean    sd  ci_low  ci_high
#      direction strong  8 0.875 0.089   0.773    0.977
#      direction   weak  8 0.688 0.164   0.585    0.790
#     F(1, 7) = 9.43, p = 0.018

# %% [markdown]
# # An audit of a paper, typed in by hand
#
# Five numbers of an invented paper, as they are printed: digits count, so they stand in quotes. Could any data have
# given them?

# %%
from pathlib import Path

import recoil

Path("paper.toml").write_text("""
[paper]
title = "A paper"

[[claims]]
place = "Methods"
quote = "ratings on a scale of 1 to 5, M = 3.47, n = 23"
kind = "grim"
mean = "3.47"
n = 23

[[claims]]
place = "Results"
quote = "M = 5.21, SD = 1.60, n = 28"
kind = "grimmer"
mean = "5.21"
sd = "1.60"
n = 28

[[claims]]
place = "Results"
quote = "12 of 14 participants (85.7 %)"
kind = "percent"
percent = "85.7%"
count = 12
n = 14

[[claims]]
place = "Results"
quote = "9 of 14 participants (65 %)"
kind = "percent"
percent = "65%"
count = 9
n = 14

[[claims]]
place = "Results"
quote = "F(2, 26), 14 people under 3 conditions"
kind = "df"
df = ["2", "26"]
design = "repeated"
counts = [14, 3]
""")

# %%
audited = recoil.audit("paper.toml")
for finding in audited.findings:
    print(f"{finding.result.verdict}: {finding.quote}")

# %% [markdown]
# `audited` shows as a table in a notebook; `audited.to_frame()` is a DataFrame with the reason of each verdict, and
# `recoil audit paper.toml --out audit` writes a page of them.

# %% [markdown]
# It prints:
#
#     only under a reading: ratings on a scale of 1 to 5, M = 3.47, n = 23
#     attainable: M = 5.21, SD = 1.60, n = 28
#     attainable: 12 of 14 participants (85.7 %)
#     not attainable: 9 of 14 participants (65 %)
#     attainable: F(2, 26), 14 people under 3 conditions

# afex's ANOVAs of several factors for the data sets in factorial.json: `Rscript make_factorial.R` in this folder writes
# factorial_expected.json. Needs R with afex and jsonlite (the versions used stand in it). The tests need none of it.

suppressPackageStartupMessages({
  library(afex)
  library(jsonlite)
})

rows_of <- function(fit) {
  table <- as.data.frame(fit$anova_table)
  plain <- as.data.frame(anova(fit, correction = "none", es = c("ges", "pes")))
  corrected <- if (is.null(attr(fit, "within")) || length(attr(fit, "within")) == 0) NULL else summary(fit)$pval.adjustments
  unname(lapply(rownames(plain), function(effect) {
    here <- !is.null(corrected) && effect %in% rownames(corrected)
    list(
      effect = effect, F = plain[effect, "F"], df = c(plain[effect, "num Df"], plain[effect, "den Df"]),
      p = plain[effect, "Pr(>F)"], ges = plain[effect, "ges"], pes = plain[effect, "pes"],
      epsilon = if (here) corrected[effect, "GG eps"] else NULL,
      p_gg = if (here) corrected[effect, "Pr(>F[GG])"] else NULL
    )
  }))
}

one <- function(set) {
  long <- as.data.frame(set$rows)
  long$who <- factor(long$who)
  for (name in intersect(c("one", "two", "three"), names(long))) long[[name]] <- factor(long[[name]])
  within <- switch(set$kind,
    "within" = c("one", "two"), "mixed" = "two", "three within" = c("one", "two", "three"),
    "two within, one between" = c("two", "three"), "between" = NULL
  )
  between <- if ("one" %in% within) NULL else "one"
  rows_of(aov_ez("who", "score", long, within = within, between = between))
}

sets <- fromJSON("factorial.json", simplifyDataFrame = TRUE, simplifyVector = TRUE)
found <- lapply(sets, one)
versions <- list(R = as.character(getRversion()), afex = as.character(packageVersion("afex")))
write(toJSON(list(versions = versions, found = found), digits = NA, auto_unbox = TRUE, null = "null", pretty = TRUE), "factorial_expected.json")

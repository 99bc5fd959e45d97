# R's numbers for the data sets in datasets.json: `Rscript make.R` in this folder writes expected.json.
# Needs R with afex, emmeans, car and jsonlite (the versions used stand in expected.json). The tests need none of it.

suppressPackageStartupMessages({
  library(afex)
  library(emmeans)
  library(jsonlite)
})

# JSON of 17 significant digits, every double exactly; what R could not compute becomes null.
as_json <- function(value, indent = "") {
  inner <- paste0(indent, " ")
  joined <- function(parts, left, right) {
    paste0(left, "\n", inner, paste(parts, collapse = paste0(",\n", inner)), "\n", indent, right)
  }
  if (is.null(value)) return("null")
  if (is.list(value)) {
    parts <- vapply(value, as_json, "", indent = inner)
    if (is.null(names(value))) return(joined(parts, "[", "]"))
    return(joined(paste0('"', names(value), '": ', parts), "{", "}"))
  }
  text <- if (is.character(value)) paste0('"', value, '"') else sprintf("%.17g", value)
  text[!is.character(value) & !is.finite(value)] <- "null"
  if (length(text) == 1 && !inherits(value, "AsIs")) text else paste0("[", paste(text, collapse = ", "), "]")
}

# NULL, said on the terminal, where R refuses: too few participants for a matrix to have an inverse.
attempt <- function(what, code) {
  tryCatch(code, error = function(refusal) {
    message(what, ": ", conditionMessage(refusal))
    NULL
  })
}

labels_of <- function(k) sprintf("c%02d", seq_len(k))
index_of <- function(label) as.integer(sub("c", "", trimws(label))) - 1L

long_table <- function(scores) {
  n <- nrow(scores)
  k <- ncol(scores)
  data.frame(
    y = as.vector(scores),
    s = factor(rep(seq_len(n), k)),
    c = factor(rep(labels_of(k), each = n), levels = labels_of(k))
  )
}

# Rows of TukeyHSD, "c03-c01" being condition 2 less condition 0.
tukey_rows <- function(fit, term) {
  rows <- TukeyHSD(fit, term)[[term]]
  unname(lapply(seq_len(nrow(rows)), function(i) {
    pair <- strsplit(rownames(rows)[i], "-")[[1]]
    list(
      a = index_of(pair[1]), b = index_of(pair[2]),
      difference = rows[i, "diff"], ci_low = rows[i, "lwr"], ci_high = rows[i, "upr"], p = rows[i, "p adj"]
    )
  }))
}

# Rows of emmeans, later condition less the earlier one, Tukey's adjustment.
emmeans_rows <- function(fit, model) {
  compared <- pairs(emmeans(fit, "c", model = model), reverse = TRUE, adjust = "tukey")
  tested <- as.data.frame(summary(compared, infer = c(TRUE, TRUE)))
  unname(lapply(seq_len(nrow(tested)), function(i) {
    pair <- strsplit(as.character(tested$contrast[i]), " - ")[[1]]
    list(
      a = index_of(pair[1]), b = index_of(pair[2]),
      difference = tested$estimate[i], se = tested$SE[i], df = tested$df[i], t = tested$t.ratio[i],
      p = tested$p.value[i], ci_low = tested$lower.CL[i], ci_high = tested$upper.CL[i]
    )
  }))
}

# Two-sided paired t tests of all pairs and Holm's adjustment of their p.
paired_rows <- function(long) {
  p_of <- function(method) pairwise.t.test(long$y, long$c, p.adjust.method = method, paired = TRUE)$p.value
  raw <- p_of("none")
  holm <- p_of("holm")
  rows <- list()
  for (b in colnames(raw)) for (a in rownames(raw)) if (index_of(a) > index_of(b)) {
    t <- t.test(long$y[long$c == a], long$y[long$c == b], paired = TRUE)$statistic
    rows <- c(rows, list(list(a = index_of(a), b = index_of(b), t = t[[1]], p = raw[a, b], p_holm = holm[a, b])))
  }
  rows
}

# Mauchly's W and the epsilons of car (through afex). hf_epsilon is car's raw one and may exceed 1; its p takes 1 then.
# NULL for two conditions, for participants too few, and for numbers so small that car takes their matrix for singular.
car_sphericity <- function(fit) {
  found <- summary(fit$Anova, multivariate = FALSE)
  adjusted <- found$pval.adjustments
  tested <- found$sphericity.tests
  if (NROW(adjusted) == 0 || NROW(tested) == 0) return(NULL)
  list(
    mauchly_W = tested[1, "Test statistic"], mauchly_p = tested[1, "p-value"],
    gg_epsilon = adjusted[1, "GG eps"], gg_p = adjusted[1, "Pr(>F[GG])"],
    hf_epsilon = adjusted[1, "HF eps"], hf_p = adjusted[1, "Pr(>F[HF])"]
  )
}

# The same from base R's multivariate linear model: another program, and it goes on where n <= k.
base_sphericity <- function(scores) {
  fit <- lm(scores ~ 1)
  tested <- anova(fit, X = ~1, test = "Spherical")
  epsilon <- stats:::sphericity(SSD(fit), X = ~1)
  list(
    gg_epsilon = epsilon$GG.eps, gg_p = tested[1, "G-G Pr"],
    hf_epsilon = epsilon$HF.eps, hf_p = tested[1, "H-F Pr"]
  )
}

afex_row <- function(fit, correction) {
  row <- suppressWarnings(anova(fit, es = c("ges", "pes"), correction = correction))
  list(
    df_effect = row[1, "num Df"], df_error = row[1, "den Df"], ms_error = row[1, "MSE"], F = row[1, "F"],
    p = row[1, "Pr(>F)"], ges = row[1, "ges"], pes = row[1, "pes"]
  )
}

shapiro_of <- function(fit) {
  found <- shapiro.test(residuals(fit))
  list(W = found$statistic[[1]], p = found$p.value)
}

friedman_of <- function(scores) {
  found <- friedman.test(scores)
  list(chi_squared = found$statistic[[1]], df = found$parameter[[1]], p = found$p.value)
}

within_one <- function(dataset) {
  scores <- do.call(rbind, lapply(dataset$scores, function(row) as.numeric(unlist(row))))
  long <- long_table(scores)
  strata <- summary(aov(y ~ c + Error(s / c), data = long))
  people <- strata[["Error: s"]][[1]]
  inside <- strata[["Error: s:c"]][[1]]
  pooled <- aov(y ~ s + c, data = long)
  fit <- attempt(paste0(dataset$name, ": aov_ez"), suppressWarnings(suppressMessages(
    aov_ez("s", "y", long, within = "c", include_aov = TRUE)
  )))
  say <- function(part) paste0(dataset$name, ": ", part)
  sphericity <- attempt(say("car"), suppressWarnings(car_sphericity(fit)))
  list(
    name = dataset$name,
    aov = list(
      ss_participants = people[1, "Sum Sq"], ss_effect = inside[1, "Sum Sq"], ss_error = inside[2, "Sum Sq"],
      df_effect = inside[1, "Df"], df_error = inside[2, "Df"], F = inside[1, "F value"], p = inside[1, "Pr(>F)"]
    ),
    tukey_hsd = tukey_rows(pooled, "c"),
    emmeans_univariate = attempt(say("emmeans, univariate"), emmeans_rows(fit, "univariate")),
    emmeans_multivariate = attempt(say("emmeans, multivariate"), emmeans_rows(fit, "multivariate")),
    afex = attempt(say("afex"), afex_row(fit, "none")),
    # without an epsilon of car's, afex hands back the uncorrected row, silently
    afex_gg = if (!is.null(sphericity)) attempt(say("afex, GG"), afex_row(fit, "GG")),
    afex_hf = if (!is.null(sphericity)) attempt(say("afex, HF"), afex_row(fit, "HF")),
    car_sphericity = sphericity,
    base_sphericity = if (ncol(scores) > 2) attempt(say("anova.mlm"), suppressWarnings(base_sphericity(scores))),
    friedman = friedman_of(scores),
    paired_t = attempt(say("pairwise.t.test"), paired_rows(long)),
    shapiro_residuals = attempt(say("shapiro.test"), shapiro_of(pooled))
  )
}

between_one <- function(dataset) {
  values <- lapply(dataset$groups, function(group) as.numeric(unlist(group)))
  k <- length(values)
  long <- data.frame(
    y = unlist(values),
    c = factor(rep(labels_of(k), lengths(values)), levels = labels_of(k)),
    id = factor(seq_along(unlist(values)))
  )
  fit <- aov(y ~ c, data = long)
  row <- summary(fit)[[1]]
  afex_fit <- attempt(paste0(dataset$name, ": aov_ez"), suppressMessages(aov_ez("id", "y", long, between = "c")))
  list(
    name = dataset$name,
    aov = list(
      ss_effect = row[1, "Sum Sq"], ss_error = row[2, "Sum Sq"], df_effect = row[1, "Df"], df_error = row[2, "Df"],
      F = row[1, "F value"], p = row[1, "Pr(>F)"]
    ),
    tukey_hsd = tukey_rows(fit, "c"),
    afex = attempt(paste0(dataset$name, ": afex"), afex_row(afex_fit, "none")),
    shapiro_residuals = attempt(paste0(dataset$name, ": shapiro.test"), shapiro_of(fit))
  )
}

# Rows of k, df, q, p, those with p > 1e-6.
ptukey_rows <- function(grid) {
  rows <- expand.grid(q = unlist(grid$q), df = unlist(grid$df), k = unlist(grid$k))
  rows$p <- ptukey(rows$q, rows$k, rows$df, lower.tail = FALSE)
  rows <- rows[rows$p > 1e-6, ]
  lapply(seq_len(nrow(rows)), function(i) c(rows$k[i], rows$df[i], rows$q[i], rows$p[i]))
}

# Rows of k, df, alpha, q.
qtukey_rows <- function(grid) {
  rows <- expand.grid(alpha = unlist(grid$alpha), df = unlist(grid$df), k = unlist(grid$k))
  rows$q <- qtukey(rows$alpha, rows$k, rows$df, lower.tail = FALSE)
  lapply(seq_len(nrow(rows)), function(i) c(rows$k[i], rows$df[i], rows$alpha[i], rows$q[i]))
}

# Rows of successes, trials, chance, confidence, p, ci_low, ci_high.
binom_row <- function(row) {
  row <- unlist(row)
  found <- binom.test(row[1], row[2], row[3], conf.level = row[4])
  c(unname(row), found$p.value, found$conf.int[1], found$conf.int[2])
}

packages <- c("afex", "car", "emmeans", "jsonlite")
data <- fromJSON("datasets.json", simplifyVector = FALSE)
expected <- list(
  made_with = c(
    list(R = paste(R.version$major, R.version$minor, sep = ".")),
    lapply(setNames(packages, packages), function(name) as.character(packageVersion(name)))
  ),
  within = lapply(data$within, within_one),
  between = lapply(data$between, between_one),
  ptukey = ptukey_rows(data$studentized_range$ptukey),
  qtukey = qtukey_rows(data$studentized_range$qtukey),
  binom_test = lapply(data$binomial, binom_row)
)
writeLines(as_json(expected), "expected.json")

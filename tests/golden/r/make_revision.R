# What a revision of a paper asks for, by R: `Rscript make_revision.R` in this folder writes revision_expected.json from
# revision.json (trials) and datasets.json (tables). Needs R with lme4, BayesFactor, afex, emmeans and jsonlite (the
# versions used stand in it). The tests need none of it.

suppressPackageStartupMessages({
  library(lme4)
  library(BayesFactor)
  library(afex)
  library(emmeans)
  library(jsonlite)
})

attempt <- function(what, code) {
  tryCatch(suppressWarnings(suppressMessages(code)), error = function(refusal) {
    message(what, ": ", conditionMessage(refusal))
    NULL
  })
}

scores_of <- function(set) do.call(rbind, lapply(set$scores, function(row) as.numeric(unlist(row))))
long_table <- function(scores) {
  data.frame(
    y = as.vector(scores), s = factor(rep(seq_len(nrow(scores)), ncol(scores))),
    c = factor(rep(sprintf("c%02d", seq_len(ncol(scores))), each = nrow(scores)))
  )
}

# A trend, and the first condition against the mean of the others.
weights_of <- function(k) list(trend = seq_len(k) - (k + 1) / 2, first = c(-1, rep(1 / (k - 1), k - 1)))

contrast_of <- function(scores, weights) {
  test <- t.test(as.vector(scores %*% weights))
  list(estimate = test$estimate[[1]], t = test$statistic[[1]], df = test$parameter[[1]], p = test$p.value,
       ci_low = test$conf.int[1], ci_high = test$conf.int[2])
}

emmeans_of <- function(scores) {
  fit <- aov_ez("s", "y", long_table(scores), within = "c")
  means <- emmeans(fit, "c", model = "multivariate")
  found <- as.data.frame(summary(contrast(means, weights_of(ncol(scores)), adjust = "holm")))
  list(estimate = found$estimate, se = found$SE, df = found$df, t = found$t.ratio, p_holm = found$p.value)
}

# Two one-sided t tests, spelled out with t.test.
tost_of <- function(low, high, ...) {
  below <- t.test(..., mu = low, alternative = "greater")
  above <- t.test(..., mu = high, alternative = "less")
  both <- t.test(..., conf.level = 0.9)
  list(low = low, high = high, t_low = below$statistic[[1]], p_low = below$p.value, t_high = above$statistic[[1]],
       p_high = above$p.value, df = both$parameter[[1]], ci_low = both$conf.int[1], ci_high = both$conf.int[2])
}

bounds_of <- function(values) c(-0.75, 0.5) * diff(range(values))

factor_of <- function(code) {
  set.seed(1)
  found <- extractBF(code)
  list(bf10 = found$bf[1], error = found$error[1])
}

within_one <- function(set) {
  scores <- scores_of(set)
  say <- function(part) paste0(set$name, ": ", part)
  bounds <- bounds_of(scores)
  long <- long_table(scores)
  list(
    name = set$name,
    contrasts = attempt(say("t.test"), lapply(weights_of(ncol(scores)), function(w) contrast_of(scores, w))),
    emmeans = attempt(say("emmeans"), emmeans_of(scores)),
    tost_paired = attempt(say("TOST"), tost_of(bounds[1], bounds[2], scores[, 2], scores[, 1], paired = TRUE)),
    tost_one_sample = attempt(say("TOST"), tost_of(mean(scores) + bounds[1], mean(scores) + bounds[2], scores[, 1])),
    bayes = attempt(say("BayesFactor"), factor_of(
      anovaBF(y ~ c + s, data = long, whichRandom = "s", iterations = 50000, progress = FALSE)))
  )
}

between_one <- function(set) {
  groups <- lapply(set$groups, function(group) as.numeric(unlist(group)))
  say <- function(part) paste0(set$name, ": ", part)
  bounds <- bounds_of(unlist(groups))
  long <- data.frame(y = unlist(groups), c = factor(rep(seq_along(groups), lengths(groups))))
  list(
    name = set$name,
    welch = attempt(say("TOST"), tost_of(bounds[1], bounds[2], groups[[1]], groups[[2]])),
    pooled = attempt(say("TOST"), tost_of(bounds[1], bounds[2], groups[[1]], groups[[2]], var.equal = TRUE)),
    bayes = attempt(say("BayesFactor"), factor_of(anovaBF(y ~ c, data = long, iterations = 50000, progress = FALSE)))
  )
}

trials_one <- function(set) {
  rows <- as.data.frame(set$rows)
  names(rows) <- c("who", "c", "x", "right", "y")
  rows$who <- factor(rows$who)
  rows$c <- factor(rows$c)
  tight <- list(rhobeg = 0.2, rhoend = 1e-8, maxfun = 1e5)
  formula_of <- function(y) reformulate(c(if (set$name == "a number") c("c", "x") else "c", "(1 | who)"), y)
  logit <- suppressMessages(glmer(formula_of("right"), rows, family = binomial, nAGQ = 25,
    control = glmerControl(optimizer = "bobyqa", optCtrl = tight)))
  linear <- suppressMessages(lmer(formula_of("y"), rows, control = lmerControl(optimizer = "bobyqa", optCtrl = tight)))
  told <- function(fit) {
    found <- summary(fit)$coefficients
    list(names = rownames(found), estimate = unname(found[, 1]), se = unname(found[, 2]))
  }
  sds <- as.data.frame(VarCorr(linear))$sdcor
  list(
    name = set$name, logit = c(told(logit), person_sd = unname(getME(logit, "theta"))),
    linear = c(told(linear), person_sd = sds[1], residual_sd = sds[2])
  )
}

one_way_power <- function() {
  grid <- expand.grid(k = c(2, 3, 5), n = c(2, 5, 20, 60), f = c(0.1, 0.25, 0.4), alpha = c(0.05, 0.01))
  grid$power <- mapply(function(k, n, f, alpha) {
    power.anova.test(groups = k, n = n, between.var = f^2 * k / (k - 1), within.var = 1, sig.level = alpha)$power
  }, grid$k, grid$n, grid$f, grid$alpha)
  as.matrix(grid)
}

# Two conditions are a paired t test: SD of the differences sqrt(2 (1 - rho)), difference 2 f.
paired_power <- function() {
  grid <- expand.grid(n = c(3, 8, 14, 40), f = c(0.1, 0.25, 0.4), rho = c(0, 0.5, 0.8))
  grid$power <- mapply(function(n, f, rho) {
    power.t.test(n = n, delta = 2 * f, sd = sqrt(2 * (1 - rho)), type = "paired", strict = TRUE)$power
  }, grid$n, grid$f, grid$rho)
  as.matrix(grid)
}

# Simulated: tables of n people whose conditions have these means and this covariance; F against its critical value at
# the degrees of freedom times the true epsilon. `ratio` is the SD of the last condition over that of the others.
simulated_power <- function(n, means, rho, ratio, tables = 20000) {
  set.seed(2)
  k <- length(means)
  sds <- c(rep(1, k - 1), ratio)
  covariance <- (rho + (1 - rho) * diag(k)) * outer(sds, sds)
  centring <- diag(k) - 1 / k
  inner <- centring %*% covariance %*% centring
  epsilon <- sum(diag(inner))^2 / ((k - 1) * sum(inner^2))
  draws <- matrix(rnorm(tables * n * k), ncol = k) %*% chol(covariance) + rep(means, each = tables * n)
  cells <- array(draws, c(tables, n, k))
  columns <- apply(cells, c(1, 3), mean)
  rows <- apply(cells, c(1, 2), mean)
  all <- rowMeans(columns)
  effect <- n * rowSums((columns - all)^2)
  people <- k * rowSums((rows - all)^2)
  error <- apply(cells^2, 1, sum) - n * k * all^2 - effect - people
  F <- effect / error * (n - 1)
  critical <- qf(0.95, (k - 1) * epsilon, (n - 1) * (k - 1) * epsilon)
  # what the formula wants: in the SD of a score, the SD of the means and a correlation that gives the error variance
  variance <- mean(sds^2)
  error_variance <- sum(diag(inner)) / (k - 1)
  c(n = n, k = k, f = sqrt(mean((means - mean(means))^2) / variance), correlation = 1 - error_variance / variance,
    epsilon = epsilon, power = mean(F > critical), tables = tables)
}

adjusted <- function() {
  sets <- list(c(0.01, 0.04, 0.03), c(0.5, 0.001, 0.2, 0.02, 0.02, 1), 0.03, c(0.9, 0.8, 0.7), c(0, 1e-300, 1e-9, 0.05))
  lapply(sets, function(p) list(p = I(p), holm = I(p.adjust(p, "holm")), bh = I(p.adjust(p, "BH"))))
}

packages <- c("lme4", "BayesFactor", "afex", "emmeans", "jsonlite")
tables <- fromJSON("datasets.json", simplifyVector = FALSE)
trials <- fromJSON("revision.json", simplifyDataFrame = FALSE)
expected <- list(
  made_with = c(
    list(R = as.character(getRversion())),
    lapply(setNames(packages, packages), function(name) as.character(packageVersion(name)))
  ),
  within = lapply(tables$within, within_one),
  between = lapply(tables$between, between_one),
  trials = lapply(trials, trials_one),
  one_way_power = one_way_power(),
  paired_power = paired_power(),
  simulated_power = rbind(
    simulated_power(14, c(0, 0.2, 0.5), 0.5, 1),
    simulated_power(8, c(0, 0.3, 0.3, 0.7), 0.2, 1),
    simulated_power(20, c(0, 0, 0.3), 0.7, 1),
    simulated_power(14, c(0, 0.3, 0.9), 0.4, 2),
    simulated_power(24, c(0, 0.4, 0.4, 0.8), 0.3, 2.5)
  ),
  adjusted = adjusted()
)
text <- toJSON(expected, digits = I(17), auto_unbox = TRUE, null = "null", na = "null", pretty = FALSE)
writeLines(gsub("},{", "},\n{", text, fixed = TRUE), "revision_expected.json")

# Scores from paired comparisons by R's glm, a logit for Bradley and Terry and a probit for Thurstone's case V:
# `Rscript make_pairs.R` in this folder writes pairs_expected.json from ../choix.json. BradleyTerry2 (Turner and Firth
# 2012) fits models without random effects by this same call. Needs R with jsonlite; the tests need none of it.

library(jsonlite)

fitted <- function(wins, link) {
  n <- nrow(wins)
  pairs <- t(combn(n, 2))
  difference <- matrix(0, nrow(pairs), n)
  difference[cbind(seq_len(nrow(pairs)), pairs[, 1])] <- 1
  difference[cbind(seq_len(nrow(pairs)), pairs[, 2])] <- -1
  counts <- cbind(wins[pairs], wins[pairs[, 2:1]])
  control <- glm.control(epsilon = 1e-14, maxit = 100)
  found <- glm(counts ~ 0 + difference[, -1, drop = FALSE], family = binomial(link), control = control)
  # to scores whose sum is 0: the first item's is 0 in glm
  centred <- (diag(n) - 1 / n)[, -1]
  list(scores = as.vector(centred %*% coef(found)), se = sqrt(diag(centred %*% vcov(found) %*% t(centred))))
}

cases <- fromJSON("../choix.json", simplifyVector = FALSE)
expected <- lapply(cases, function(case) {
  wins <- do.call(rbind, lapply(case$wins, unlist))
  list(`bradley-terry` = fitted(wins, "logit"), thurstone = fitted(wins, "probit"))
})
write(toJSON(list(r = R.version.string, cases = expected), auto_unbox = TRUE, digits = 15), "pairs_expected.json")

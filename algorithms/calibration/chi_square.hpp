/// The chi-square distribution: what a sum of squared standard normal errors may reach by chance.
#pragma once

namespace firstlook {

/// Probability that a sum of `dof` squares is at most `x`: the regularised incomplete gamma function P(dof/2, x/2) by
/// series or continued fraction (Abramowitz and Stegun 6.5.29 and 6.5.31), to about 1e-12. 0 for x <= 0.
[[nodiscard]] double chi_square_probability(double x, int dof);

/// The same when the errors have means whose squares sum up to `noncentrality`: a mixture of chi-squares with Poisson
/// weights (Abramowitz and Stegun 26.4.25).
[[nodiscard]] double chi_square_probability(double x, int dof, double noncentrality);

/// What the sum stays below with `probability` (0 to 1, both excluded).
[[nodiscard]] double chi_square_quantile(double probability, int dof);

/// Sum of the squared means from which on a test that turns down the share `significance` of right hypotheses turns
/// down the share `power` of those that are wrong by so much. `power` must exceed `significance`.
[[nodiscard]] double detectable_noncentrality(int dof, double significance, double power);

}  // namespace firstlook

// SPDX-License-Identifier: Apache-2.0
// From the competition to an answer: which effects, how sure, and within which intervals.
//
// Weights. No hypothesis is exactly the plant, so a difference of log-likelihood over one record is
// no probability. The record is cut into B parts and drawn again by the Bayesian bootstrap:
//   w_h = mean over draws of softmax_h( sum over parts of B g_b s_hb ),  g ~ Dirichlet(1, ..., 1)
//   s_hb  share of part b in the score of hypothesis h, nats
// A name that is better everywhere keeps its weight; one that is better by a single part shares it.
//
// Intervals. The spread of the members is too narrow if no law is exactly the plant's. It is
// widened to that of estimates from other records of the same plant, which follows from the parts:
//   V = B/(B - 1) sum over parts of (cov(theta, l_b) - mean)^2      l_b  log-likelihood of part b
//
// Absolute fit. Weights compare hypotheses; they don't notice that all are wrong. A right name
// leaves no more of PV on the last third than `floors` times the floor: noise, disturbance, and the
// law's own error.
//
// Sources: Yao, Vehtari, Simpson and Gelman, Bayesian Analysis 13 (2018) 917-1007 (pseudo-BMA+);
// Giordano and Broderick, The Bayesian infinitesimal jackknife for variance (2023).
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "model/estimator/competition.hpp"

namespace loopwarden::estimator {

struct Interval {
  double value = 0.0;
  std::array<double, 2> within{};  // 95 %
};

// 95 % intervals of the parameters of each effect of `fit`, by name, around those of `shown`.
std::vector<std::map<std::string, Interval>> intervals(const Likelihood& likelihood, const Fit& fit,
                                                       const Fit& shown);

// Log-likelihood of each part of the record, nats.
std::vector<double> parts_of(const Solution& solution);

// Weight of each fit; the sum is 1.
std::vector<double> weights(const std::vector<Fit>& fits);

// Student's t of the lead of one fit over another, by parts of the record.
double lead_t(const Fit& more, const Fit& less);

}  // namespace loopwarden::estimator

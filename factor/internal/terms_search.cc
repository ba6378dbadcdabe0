#include "factor/internal/terms_search.h"

#include "factor/internal/kept_terms.h"
#include "factor/internal/measure.h"
#include "factor/internal/quantize.h"
#include "factor/internal/reciprocal_totals.h"

#include <fmt/format.h>
#include <map>

namespace nacre::factor::internal {
namespace {

class TermsSearch {
 public:
  TermsSearch(Job& job, Method& method, const Describe& describe)
      : job_(job), method_(method), describe_(describe) {}

  const Factorization& With(int terms) {
    const auto found = made_.find(terms);
    if (found != made_.end()) {
      return found->second;
    }
    Factorization made{method_.Make(terms), {}};
    const Quantization rounding = Quantize(job_, job_.options.bits, made.material);
    if (const int idle = DropIdleTerms(made.material); idle > 0) {
      made.summary.notes.push_back(fmt::format(
          "rounding leaves nothing of {} of {} terms: they are left out", idle, terms));
    }
    if (made.material.form == Form::kReciprocal && job_.options.totals < 1) {
      BalanceTotals(job_, job_.options.totals, made.material);
    }
    Measure(job_, made.material, made.summary);
    made.summary.bits = rounding.bits;
    made.summary.added_l2 = rounding.added_l2;
    made.summary.added_log = rounding.added_log;
    method_.Describe(made.summary);
    describe_(made.summary, made.material);
    made.summary.bytes = FileBytes(made.material);
    return made_.emplace(terms, std::move(made)).first->second;
  }

  // The first of [1, most] for which `good` holds, if it holds for `most`.
  template <class Good>
  int First(int most, Good&& good) {
    int least = 1;
    while (least < most) {
      const int middle = least + (most - least) / 2;
      if (good(With(middle).summary)) {
        most = middle;
      } else {
        least = middle + 1;
      }
    }
    return most;
  }

 private:
  Job& job_;
  Method& method_;
  const Describe& describe_;
  std::map<int, Factorization> made_;
};

}  // namespace

Factorization SearchTerms(Job& job, Method& method, const Describe& describe) {
  TermsSearch search(job, method, describe);
  std::vector<std::string> notes;
  int terms = method.MostTerms();
  const double bytes = job.options.bytes;
  const auto too_large = [&](const FactorSummary& s) {
    return static_cast<double>(s.bytes) > bytes;
  };
  if (bytes > 0 && too_large(search.With(terms).summary)) {
    terms = std::max(1, search.First(terms, too_large) - 1);
    if (too_large(search.With(terms).summary)) {
      notes.push_back(fmt::format(
          "one term already takes {} bytes, more than the {:.0f} asked for; "
          "fewer bits, clusters or points would take less",
          search.With(terms).summary.bytes,
          bytes));
    }
  }
  const double error = job.options.error;
  const auto reached = [&](const FactorSummary& s) { return s.relative_l2 <= error; };
  if (error > 0 && reached(search.With(terms).summary)) {
    terms = search.First(terms, reached);
  } else if (error > 0) {
    notes.push_back(fmt::format(
        "the error asked for, {:.4g}, is not reached with {} terms: it is {:.4g}; "
        "allow more terms",
        error,
        terms,
        search.With(terms).summary.relative_l2));
  }
  Factorization result = search.With(terms);
  result.summary.notes.insert(result.summary.notes.end(), notes.begin(), notes.end());
  return result;
}

}  // namespace nacre::factor::internal

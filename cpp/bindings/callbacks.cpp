#include "callbacks.hpp"

namespace energymargin::binding {
namespace {

bool has_function(const Region& region) {
  const auto of_expression = [](const auto& expression) {
    using Expression = std::decay_t<decltype(expression)>;
    if constexpr (is_of_regions<Expression>) {
      return std::any_of(expression.of.begin(), expression.of.end(), has_function);
    } else {
      return std::is_same_v<Expression, regions::Predicate>;
    }
  };
  return std::visit(of_expression, region.expression());
}

Region unshared(const Region& region) {
  if (!has_function(region)) return region;
  const auto of_expression = [&](const auto& expression) -> Region {
    using Expression = std::decay_t<decltype(expression)>;
    if constexpr (std::is_same_v<Expression, regions::Predicate>) {
      const auto* asked = expression.contains.template target<AskedPredicate>();
      if (asked) return regions::Predicate{AskedPredicate{asked->function.unshared()}};
    } else if constexpr (is_of_regions<Expression>) {
      Expression parts;
      for (const Region& part : expression.of) parts.of.push_back(unshared(part));
      return parts;
    }
    return region;
  };
  return std::visit(of_expression, region.expression());
}

}  // namespace

void unshare(Region& region) { region = unshared(region); }

void unshare(Plan& plan) {
  const auto* asked = plan.policy ? plan.policy->act.target<AskedPolicy>() : nullptr;
  if (asked == nullptr) return;
  auto policy = std::make_shared<Policy>(*plan.policy);
  policy->act = AskedPolicy{asked->function.unshared()};
  plan.policy = std::move(policy);
}

void unshare(Problem& problem) {
  unshare(problem.captured);
  for (auto* set : {&problem.succeeded, &problem.captured_any, &problem.succeeded_any, &problem.within}) {
    if (*set) unshare(**set);
  }
  if (problem.plan) unshare(*problem.plan);
}

}  // namespace energymargin::binding

#include <array>
#include <cstdio>

#include "api/fields.h"
#include "api/job_request.h"
#include "api/json_pointer.h"
#include "api/json_reader.h"
#include "api/parse_options.h"
#include "api/parse_scene.h"
#include "api/problems.h"

namespace penumbra::api {

namespace {

JsonBudget budget_of(const Limits& limits) {
  JsonBudget budget;
  budget.max_bytes = limits.max_body_bytes;
  budget.max_depth = limits.max_json_depth;
  budget.max_values = limits.max_json_values;
  budget.max_string_bytes = limits.max_string_bytes;
  return budget;
}

JsonDocument string_value(const std::string& text) {
  JsonDocument document;
  JsonNode node;
  node.tag = JsonNode::Tag::string;
  node.next = 1;
  node.span = {0, static_cast<std::uint32_t>(text.size())};
  document.nodes.push_back(node);
  document.text = text;
  return document;
}

JsonDocument override_value(const std::string& text, const JsonBudget& budget) {
  try {
    return read_json(text, budget);
  } catch (const InvalidBody&) {
    return string_value(text);
  }
}

/// Those that are NAME=VALUE; the others are reported.
std::vector<Override> read_overrides(const std::vector<std::string>& texts, const JsonBudget& budget,
                                     ErrorList& errors) {
  std::vector<Override> overrides;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos) {
      errors.add("/options" + pointer_step(name), "must be given as NAME=VALUE");
    } else {
      overrides.push_back({name, override_value(text.substr(equals + 1), budget)});
    }
  }
  return overrides;
}

std::string in_words(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.3g", value);
  return buffer.data();
}

void check_cost(const CostEstimate& cost, const Limits& limits, ErrorList& errors) {
  if (cost.work > limits.max_work) {
    errors.add("/options",
               "the predicted work (pixels, times samples, times light samples, times rays a camera ray can become; at "
               "most " +
                   in_words(work_of_a_second) + " for each second of a time budget) must be at most " +
                   in_words(limits.max_work) + "; it is " + in_words(cost.work));
  }
  if (cost.memory_bytes > limits.max_memory_bytes) {
    errors.add("/options", "the predicted memory must be at most " + std::to_string(limits.max_memory_bytes) +
                               " bytes; it is " + std::to_string(cost.memory_bytes));
  }
}

}  // namespace

JobRequest parse_job(std::string_view body, const Limits& limits) { return parse_job(body, {}, limits); }

JobRequest parse_job(std::string_view body, const std::vector<std::string>& overrides, const Limits& limits) {
  const JsonBudget budget = budget_of(limits);
  const JsonDocument document = read_json(body, budget);
  const JsonDocument no_options = read_json("{}", budget);

  ErrorList errors;
  for (const FieldError& twice : document.duplicates) errors.add(twice.pointer, twice.detail);
  const Field whole(document.root(), errors);
  const std::vector<Override> set = read_overrides(overrides, budget, errors);
  JobRequest request;
  Members members(whole);
  if (const auto scene = members.required("scene")) request.scene = read_scene(*scene, limits);
  const Field options = members.optional("options").value_or(Field(whole, "options", no_options.root()));
  if (members.is_object()) request.options = read_options(options, set, limits);
  members.refuse_unknown();
  if (errors.is_empty()) check_cost(estimate_cost(request), limits, errors);
  if (!errors.is_empty()) throw InvalidBody(invalid_job(errors.all()));
  return request;
}

}  // namespace penumbra::api

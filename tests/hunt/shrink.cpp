#include "tests/hunt/shrink.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace penumbra::hunt {
namespace {

using Clock = std::chrono::steady_clock;
using Pointer = Json::json_pointer;

class Shrinker {
 public:
  Shrinker(const Json& job, const Finding& finding, std::uint64_t seed, double seconds)
      : best_{job, finding},
        seed_(seed),
        end_(Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))) {}

  Shrunk run() {
    zoom();  // first: all that follows is quicker then
    std::string before;
    while (before != best_.job.dump() && !is_late()) {
      before = best_.job.dump();
      for (const char* list : {"/scene/lights", "/scene/objects"}) thin(Pointer(list));
      drop_fields();
    }
    for (const int digits : {3, 4, 6}) round_all(digits);
    plain_materials();
    round_each();
    return best_;
  }

 private:
  bool is_late() const { return Clock::now() > end_; }

  bool keep(const Json& smaller) {
    if (is_late() || smaller == best_.job) return false;
    try {
      const Report report = examine(api::parse_job(smaller.dump()), seed_, check_of(best_.finding.kind));
      const auto same = std::ranges::find(report.findings, best_.finding.kind, &Finding::kind);
      if (same == report.findings.end()) return false;
      best_ = {smaller, *same};
      return true;
    } catch (const std::exception&) {
      return false;  // no scene any more
    }
  }

  /// Halves first, then one by one; groups become their members.
  void thin(const Pointer& place) {
    if (!best_.job.contains(place)) return;
    for (std::size_t step = std::max<std::size_t>(1, best_.job[place].size() / 2); step > 0; step /= 2) {
      for (std::size_t i = 0; i < best_.job[place].size() && !is_late();) {
        Json smaller = best_.job;
        Json& list = smaller[place];
        const auto last = static_cast<std::ptrdiff_t>(std::min(i + step, list.size()));
        list.erase(list.begin() + static_cast<std::ptrdiff_t>(i), list.begin() + last);
        if (!keep(smaller)) i += step;
      }
    }
    for (std::size_t i = 0; i < best_.job[place].size(); ++i) {
      if (best_.job[place][i].contains("objects")) thin(place / i / "objects");
    }
  }

  void collect(const Json& node, const Pointer& place, bool wants_numbers, std::vector<Pointer>& out) const {
    if (node.is_number() && wants_numbers) out.push_back(place);
    if (node.is_object()) {
      for (const auto& [name, value] : node.items()) {
        if (!wants_numbers) out.push_back(place / name);
        collect(value, place / name, wants_numbers, out);
      }
    } else if (node.is_array()) {
      for (std::size_t i = 0; i < node.size(); ++i) collect(node[i], place / i, wants_numbers, out);
    }
  }

  void drop_fields() {
    std::vector<Pointer> fields;
    collect(best_.job, Pointer(), false, fields);
    for (const Pointer& field : fields) {
      if (is_late()) return;
      // Without a size the picture grows.
      if (field.back() == "width" || field.back() == "height") continue;
      if (!best_.job.contains(field) || field.back() == "type" || field.parent_pointer().empty()) continue;
      Json smaller = best_.job;
      smaller[field.parent_pointer()].erase(field.back());
      keep(smaller);
    }
  }

  /// A few pixels around the one that is wrong.
  void zoom() {
    for (const int edge : {4, 8}) {
      const int column = best_.finding.column, row = best_.finding.row;
      if (column < 0 || !best_.job["scene"]["camera"].contains("vertical_fov")) return;
      Json smaller = best_.job;
      Json &camera = smaller["scene"]["camera"], &options = smaller["options"];
      const double width = options.value("width", 800), height = options.value("height", 800);
      if (width <= edge && height <= edge) return;
      const api::JobRequest job = api::parse_job(best_.job.dump());
      const Vec3 ahead = math::normalize(job.scene.camera.direction),
                 right = math::normalize(math::cross(ahead, job.scene.camera.up)), up = math::cross(right, ahead);
      const double tangent = std::tan(camera["vertical_fov"].get<double>() * 3.14159265358979 / 360);
      const Vec3 towards = ahead + right * (((column + 0.5) / width - 0.5) * 2 * tangent * width / height) +
                           up * ((0.5 - (row + 0.5) / height) * 2 * tangent);
      camera.erase("look_at");
      camera["direction"] = Maker::json(towards);
      camera["vertical_fov"] = std::atan(tangent * edge / height) * 360 / 3.14159265358979;
      options["width"] = options["height"] = edge;
      if (keep(smaller)) return;
    }
  }

  static double rounded(double value, int digits) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return std::atof(text);
  }

  void round_all(int digits) {
    Json smaller = best_.job;
    std::vector<Pointer> numbers;
    collect(smaller, Pointer(), true, numbers);
    for (const Pointer& number : numbers) {
      if (smaller[number].is_number_float()) smaller[number] = rounded(smaller[number], digits);
    }
    keep(smaller);
  }

  void plain_materials() {
    std::vector<Pointer> fields;
    collect(best_.job, Pointer(), false, fields);
    for (const Pointer& field : fields) {
      if (field.back() == "material" && best_.job.contains(field) && best_.job[field].is_object() &&
          !best_.job[field].contains("transmission")) {
        Json smaller = best_.job;
        smaller[field] = {{"diffuse", 0.5}};
        keep(smaller);
      }
      if (best_.job.contains(field) && best_.job[field].is_array() && best_.job[field].size() == 3 &&
          (field.back() == "diffuse" || field.back() == "intensity" || field.back() == "transmission")) {
        Json smaller = best_.job;
        smaller[field] = rounded(best_.job[field][0], 1);
        keep(smaller);
      }
    }
  }

  void round_each() {
    std::vector<Pointer> numbers;
    collect(best_.job, Pointer(), true, numbers);
    for (const Pointer& number : numbers) {
      const double value = best_.job[number];
      for (const double simple : {0.0, rounded(value, 1), rounded(value, 2)}) {
        if (is_late()) return;
        Json smaller = best_.job;
        smaller[number] = simple;
        if (simple == value || keep(smaller)) break;
      }
    }
  }

  Shrunk best_;
  std::uint64_t seed_;
  Clock::time_point end_;
};

}  // namespace

Shrunk shrink(const Json& job, const Finding& finding, std::uint64_t seed, double seconds) {
  return Shrinker(job, finding, seed, seconds).run();
}

}  // namespace penumbra::hunt

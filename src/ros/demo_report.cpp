// SPDX-License-Identifier: BSD-3-Clause
#include "demo_report.hpp"

#include <cstdarg>
#include <cstdio>
#include <numeric>

#include "unirit/status.hpp"

namespace unirit {
namespace {

constexpr double kMillimetres = 1000.0;

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

std::string format(const char* pattern, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof(text), pattern, arguments);
  va_end(arguments);
  return text;
}

bool succeeded(const RegistrationResult& result) {
  return result.status == RegistrationResult::SUCCEEDED;
}

std::string errorsText(const TrueErrors& errors) {
  return format("true error %.1f mm (rigid part alone %.1f, before %.1f)",
                errors.deformed * kMillimetres, errors.rigid * kMillimetres,
                errors.before * kMillimetres);
}

const char* statusName(const RegistrationResult& result) {
  return toString(static_cast<Status>(result.status));
}

}  // namespace

void Tally::add(const RegistrationResult& result, const TrueErrors& errors) {
  ++registrations;
  if (!unirit::succeeded(result)) return;
  ++succeeded;
  sum.before += errors.before;
  sum.rigid += errors.rigid;
  sum.deformed += errors.deformed;
}

std::string describe(const RegistrationResult& result, const TrueErrors& errors) {
  const std::string head = format("registration %u %s", result.id, statusName(result));
  if (!succeeded(result)) return head + ": " + result.message;
  const double milliseconds =
      std::accumulate(result.stage_milliseconds.begin(), result.stage_milliseconds.end(), 0.0);
  return head +
         format(" from %s: surface residual %.1f mm, displacement %.1f mm, ", result.start.c_str(),
                result.residual_rms * kMillimetres, result.displacement_rms * kMillimetres) +
         errorsText(errors) + format(", %.0f ms", milliseconds);
}

std::string describe(const Tally& tally) {
  const std::string head =
      format("%d of %d registrations succeeded", tally.succeeded, tally.registrations);
  if (tally.succeeded == 0) return head;
  const double count = tally.succeeded;
  return head + "; mean " +
         errorsText(
             {tally.sum.before / count, tally.sum.rigid / count, tally.sum.deformed / count});
}

visualization_msgs::Marker statusText(const RegistrationResult& result, const TrueErrors& errors,
                                      double height) {
  visualization_msgs::Marker marker;
  marker.ns = "status";
  marker.type = visualization_msgs::Marker::TEXT_VIEW_FACING;
  marker.pose.orientation.w = 1.0;
  marker.scale.z = height;
  marker.color.a = 1.0F;
  marker.color.r = succeeded(result) ? 0.3F : 1.0F;
  marker.color.g = succeeded(result) ? 1.0F : 0.4F;
  marker.color.b = 0.3F;
  marker.text = format("registration %u %s\n", result.id, statusName(result));
  if (succeeded(result)) {
    marker.text +=
        format("surface residual %.1f mm, displacement %.1f mm\n",
               result.residual_rms * kMillimetres, result.displacement_rms * kMillimetres) +
        errorsText(errors);
  } else {
    marker.text += result.message;
  }
  return marker;
}

}  // namespace unirit

#include "pipeline/export_format.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/error.h"
#include "formats/lower_case.h"

namespace cairn::pipeline {

std::string export_format_names() {
  std::string names;
  for (const formats::ScanFormat& format : formats::scan_formats())
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format.name);
  return fmt::format("{} or {}", names, kTilesFormat);
}

const formats::ScanFormat& export_format(const std::string& name,
                                         const std::filesystem::path& output) {
  const auto all = formats::scan_formats();
  const std::string suffix = formats::lower_suffix(output);
  const auto at = std::ranges::find_if(all, [&](const formats::ScanFormat& format) {
    return name.empty() ? std::ranges::find(format.suffixes, suffix) != format.suffixes.end()
                        : format.name == name;
  });
  if (at != all.end()) return *at;
  if (!name.empty())
    throw formats::Error(
        formats::ErrorKind::kUsage,
        {.what = "--format", .found = "'" + name + "'", .expected = export_format_names()});
  std::string suffixes;
  for (const formats::ScanFormat& format : all)
    for (const std::string_view known : format.suffixes)
      suffixes += fmt::format("{}{}", suffixes.empty() ? "" : ", ", known);
  throw formats::Error(formats::ErrorKind::kUsage,
                       {.what = "the suffix of " + output.string() + " tells no format",
                        .found = "'" + suffix + "'",
                        .expected = suffixes + "; or --format " + export_format_names()});
}

std::uint64_t export_scan(const formats::ScanFormat& format, const ScanExport& job) {
  const formats::ScanInfo description =
      stages::describe_export(job.dataset, job.selection, format.takes_steps);
  const auto writer = formats::create_scan_writer(format, job.output, description,
                                                  description.claimed_points, job.force);
  const std::uint64_t written =
      stages::export_points(job.context, job.dataset, job.selection, description, *writer);
  if (written == 0) formats::throw_usage("no point lies inside the box: nothing is written");
  writer->finish();
  return written;
}

}  // namespace cairn::pipeline

#include "world/saves/session.h"

#include <algorithm>
#include <chrono>
#include <new>

#include "world/base/file.h"
#include "world/base/jobs.h"
#include "world/saves/meta.h"

namespace world {

namespace {

double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Encodes rows on all threads, a batch at a time, and puts them in order.
Status put_rows(SaveFile::Transaction& transaction, size_t count, const std::function<Result<RegionRow>(size_t)>& row) {
  constexpr size_t kBatch = 32;
  for (size_t first = 0; first < count; first += kBatch) {
    const size_t n = std::min(kBatch, count - first);
    std::vector<std::optional<Result<RegionRow>>> rows(n);
    parallel_for(n, [&](size_t i) { rows[i] = row(first + i); });
    for (std::optional<Result<RegionRow>>& r : rows) {
      if (!r->ok()) return r->error();
      TRY_STATUS(transaction.put(std::move(**r)));
    }
  }
  return {};
}

Status put_layer(SaveFile::Transaction& transaction, const SaveWork::LayerPart& part, PayloadOptions payload) {
  if (payload.codec == Codec::context) payload.codec = Codec::zstd;  // the former knows blocks only
  std::vector<RegionPos> held;
  for (const RegionPos& r : part.regions) {
    if (std::visit([&](const auto& values) { return values.holds(r); }, *part.values))
      held.push_back(r);
    else
      TRY_STATUS(transaction.remove(part.layer, r));
  }
  return put_rows(transaction, held.size(), [&](size_t i) -> Result<RegionRow> {
    RegionRow row;
    row.layer = part.layer, row.pos = held[i], row.codec = payload.codec;
    TRY(row.bytes, encode_payload(*part.values, held[i], payload));
    return row;
  });
}

Status drop_layer(SaveFile& file, SaveFile::Transaction& transaction, Layer layer) {
  TRY(const std::vector<RegionPos> before, file.positions(layer));
  for (const RegionPos& r : before) TRY_STATUS(transaction.remove(layer, r));
  return {};
}

Status write_work(SaveFile& file, SaveWork& work, const PayloadOptions& payload, SaveReport& report) {
  TRY(const auto transaction, SaveFile::Transaction::begin(file));
  TRY_STATUS(transaction->put_blocks(work.first_new_block, work.new_blocks));
  TRY_STATUS(transaction->put_meta(work.meta));
  static const std::shared_ptr<const PackedRegion> air =
      std::make_shared<const PackedRegion>([](int) { return LeafBlocks{}; });
  TRY_STATUS(put_rows(*transaction, work.regions.size(), [&](size_t i) -> Result<RegionRow> {
    RegionRow row;
    row.pos = work.regions.pos(i), row.codec = payload.codec;
    for (const auto& [block, n] : work.regions.census(i)) row.voxels += static_cast<int64_t>(n);
    row.census = census_text(work.regions.census(i), *work.names);
    const std::shared_ptr<const PackedRegion> packed = work.regions.packed(i);
    TRY(row.bytes, encode_payload(packed ? *packed : *air, row.pos, payload));
    work.regions.release(i);
    return row;
  }));
  for (const Layer layer : work.dropped) TRY_STATUS(drop_layer(file, *transaction, layer));
  for (const SaveWork::LayerPart& part : work.layers) TRY_STATUS(put_layer(*transaction, part, payload));
  TRY_STATUS(transaction->commit());
  report.regions = work.regions.size();
  report.bytes = transaction->bytes();
  return {};
}

void take_blocks(const BlockPalette& palette, size_t first, SaveWork& work) {
  work.first_new_block = static_cast<BlockId>(first);
  for (size_t id = first; id < palette.size(); ++id) work.new_blocks.push_back(palette[static_cast<BlockId>(id)]);
}

std::shared_ptr<const std::vector<std::string>> block_names(const BlockPalette& palette) {
  auto names = std::make_shared<std::vector<std::string>>();
  for (size_t id = 0; id < palette.size(); ++id) names->push_back(palette[static_cast<BlockId>(id)].name);
  return names;
}

/// visit(layer, values) for each layer that the store has.
template <class Visit>
void for_each_layer(const Store& store, Visit visit) {
  for (size_t i = 0; i < layer_rows().size(); ++i)
    if (const auto layer = static_cast<Layer>(i); layer != Layer::block)
      if (const AnyLayer* values = store.find_any_layer(layer)) visit(layer, *values);
}

}  // namespace

Status write_new_save(const World& world, const std::filesystem::path& path, const PayloadOptions& options) {
  TRY(const auto file, SaveFile::create(path));
  SaveWork work;
  work.regions = world.store.snapshot(world.store.regions());
  work.meta = meta_of(world);
  take_blocks(*world.palette, 1, work);
  work.names = block_names(*world.palette);
  for_each_layer(world.store, [&](Layer layer, const AnyLayer& any) {
    work.layers.push_back({layer, std::visit([](const auto& values) { return values.regions(); }, any),
                           std::shared_ptr<const AnyLayer>(std::shared_ptr<void>(), &any)});
  });
  SaveReport report;
  return write_work(*file, work, options, report);
}

// ---- the session -----------------------------------------------------------------------------------------------

Result<std::unique_ptr<SaveSession>> SaveSession::open(const std::filesystem::path& path, const Options& options) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return create(path, World(standard_blocks()), options);
  TRY(auto file, SaveFile::open(path, SaveFile::Access::edit, options.vfs));
  TRY(World world, options.load ? file->read_all() : file->read_frame());
  return std::unique_ptr<SaveSession>(new SaveSession(std::move(file), std::move(world), options));
}

Result<std::unique_ptr<SaveSession>> SaveSession::create(const std::filesystem::path& path, World&& world,
                                                         const Options& options) {
  TRY_STATUS(write_file_atomically(
      path, [&](const std::filesystem::path& temporary) { return write_new_save(world, temporary, options.payload); }));
  TRY(auto file, SaveFile::open(path, SaveFile::Access::edit, options.vfs));
  world.store.mark_saved();
  return std::unique_ptr<SaveSession>(new SaveSession(std::move(file), std::move(world), options));
}

SaveSession::SaveSession(std::unique_ptr<SaveFile> file, World world, const Options& options)
    : file_(std::move(file)),
      world_(std::move(world)),
      options_(options),
      saved_blocks_(world_.palette->size()),
      saved_meta_(meta_of(world_).rows),
      writer_([this] { run(); }) {}

SaveSession::~SaveSession() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  writer_.join();
}

bool SaveSession::has_changes() const {
  return world_.store.has_unsaved() || world_.palette->size() != saved_blocks_ || meta_of(world_).rows != saved_meta_;
}

SaveWork SaveSession::take_work() {
  SaveWork work;
  writing_regions_ = world_.store.unsaved();
  work.regions = world_.store.snapshot(writing_regions_);
  writing_ = {writing_regions_.begin(), writing_regions_.end()};
  writing_layers_.clear();
  for_each_layer(world_.store, [&](Layer layer, const AnyLayer& any) {
    std::vector<RegionPos> changed = std::visit([](const auto& values) { return values.unsaved(); }, any);
    if (changed.empty()) return;
    writing_.insert(changed.begin(), changed.end());
    writing_layers_[layer] = changed;
    auto copy = std::make_shared<const AnyLayer>(
        std::visit([&](const auto& values) { return AnyLayer(values.copy_of(changed)); }, any));
    work.layers.push_back({layer, std::move(changed), std::move(copy)});
  });
  work.dropped = writing_dropped_ = world_.store.dropped_layers();
  world_.store.mark_saved();
  work.meta = meta_of(world_);
  writing_meta_ = work.meta.rows;
  take_blocks(*world_.palette, saved_blocks_, work);
  if (!names_ || names_->size() != world_.palette->size()) names_ = block_names(*world_.palette);
  work.names = names_;
  writing_blocks_ = world_.palette->size();
  return work;
}

bool SaveSession::begin_save() {
  finish();
  if (saving_ || !has_changes()) return false;
  const auto start = std::chrono::steady_clock::now();
  SaveWork work = take_work();
  report_ = {};
  report_.snapshot_ms = ms_since(start);
  saving_ = true;
  {
    const std::lock_guard lock(mutex_);
    work_ = std::move(work);
  }
  wake_.notify_all();
  return true;
}

/// Takes in the result of a save that has ended.
void SaveSession::finish() {
  std::optional<Status> result;
  {
    const std::lock_guard lock(mutex_);
    if (!result_) return;
    result.swap(result_);
    written_.snapshot_ms = report_.snapshot_ms;
    report_ = written_;
  }
  saving_ = false;
  if (result->ok()) {
    saved_blocks_ = writing_blocks_;
    saved_meta_ = std::move(writing_meta_);
    last_error_.reset();
  } else {
    world_.store.mark_unsaved(writing_regions_);
    for (const auto& written : writing_layers_)
      if (world_.store.find_any_layer(written.first))
        std::visit([&](auto& values) { values.mark_unsaved(written.second); },
                   world_.store.make_any_layer(written.first));
    world_.store.mark_dropped(writing_dropped_);
    last_error_ = result->error();
  }
  writing_.clear();
}

void SaveSession::tick(double now_s) {
  finish();
  if (!last_save_s_) last_save_s_ = now_s;
  if (options_.autosave_s <= 0 || saving_ || now_s - *last_save_s_ < options_.autosave_s) return;
  last_save_s_ = now_s;
  begin_save();
}

Status SaveSession::wait() {
  {
    std::unique_lock lock(mutex_);
    if (saving_) done_.wait(lock, [this] { return result_.has_value(); });
  }
  finish();
  return last_error_ ? Status{*last_error_} : Status{};
}

Status SaveSession::save() {
  (void)wait();  // an earlier failure is tried again now
  if (!begin_save()) return {};
  return wait();
}

Status SaveSession::close() { return save(); }

void SaveSession::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || work_; });
    if (!work_) return;
    SaveWork work = std::move(*work_);
    work_.reset();
    lock.unlock();
    const auto start = std::chrono::steady_clock::now();
    SaveReport report;
    Status status;
    try {
      status = write_work(*file_, work, options_.payload, report);
    } catch (const std::bad_alloc&) {
      status = input_error(file_->path() + ": memory ran out while the world was saved; its last save is as it was");
    }
    work = {};
    report.write_ms = ms_since(start);
    lock.lock();
    written_ = report;
    result_ = status;
    done_.notify_all();
  }
}

}  // namespace world

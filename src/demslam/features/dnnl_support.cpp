#include "demslam/features/internal/dnnl_support.h"

namespace demslam::nn {

const dnnl::engine& cpu() {
  static const dnnl::engine instance(dnnl::engine::kind::cpu, 0);
  return instance;
}

const dnnl::stream& stream() {
  thread_local const dnnl::stream instance(cpu());
  return instance;
}

dnnl::memory::data_type data_type(Type type) {
  return type == Type::bf16 ? dnnl::memory::data_type::bf16 : dnnl::memory::data_type::f32;
}

dnnl::primitive_attr own_scratch() {
  dnnl::primitive_attr attributes;
  attributes.set_scratchpad_mode(dnnl::scratchpad_mode::user);
  return attributes;
}

dnnl::memory scratch_memory(const dnnl::memory::desc& size) {
  thread_local Pool pool;
  thread_local std::shared_ptr<std::byte> memory;
  thread_local std::size_t bytes = 0;
  if (size.get_size() > bytes) memory = pool.allocate(bytes = size.get_size());
  return on_memory(size, memory.get());
}

dnnl::memory on_memory(const dnnl::memory::desc& description, const void* start) {
  return {description, cpu(), const_cast<void*>(start)};
}

Array reordered(Pool& pool, const Array& from, const dnnl::memory::desc& as, const dnnl::memory::desc& to) {
  const auto elements = static_cast<std::int64_t>(to.get_size() / dnnl::memory::data_type_size(to.get_data_type()));
  Array result = make_array(pool, to.get_data_type() == dnnl::memory::data_type::bf16 ? Type::bf16 : Type::f32,
                            {elements});  // with the padding of blocked orders
  dnnl::memory source = on_memory(as, from.start), target = on_memory(to, result.start);
  dnnl::reorder(source, target).execute(const_cast<dnnl::stream&>(stream()), source, target);
  return result;
}

Pool& Scratch::pool() {
  thread_local Pool instance;
  return instance;
}

}  // namespace demslam::nn

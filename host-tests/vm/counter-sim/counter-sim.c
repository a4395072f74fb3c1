// SPDX-License-Identifier: GPL-2.0
/*
 * Counter devices for tests, counter-sim.0 to counter-sim.3: the count is written by sysfs (count0/count) and wraps after
 * count0/ceiling; writing a channel to index_pulse or capture_pulse of the device makes that event, stamped by the kernel.
 * Capturing also keeps the count of that moment in count0/capture. Unbind and bind a device to unplug it and plug it in.
 */
#include <linux/counter.h>
#include <linux/module.h>
#include <linux/platform_device.h>

#define COUNTERS 4

struct counter_sim {
	u64 count;
	u64 ceiling;
	u64 captured;
	u8 enabled;
};

static int count_read(struct counter_device *counter, struct counter_count *count, u64 *value)
{
	struct counter_sim *const sim = counter_priv(counter);

	*value = sim->count;
	return 0;
}

static int count_write(struct counter_device *counter, struct counter_count *count, u64 value)
{
	struct counter_sim *const sim = counter_priv(counter);

	if (value > sim->ceiling)
		return -ERANGE;
	sim->count = value;
	return 0;
}

static int function_read(struct counter_device *counter, struct counter_count *count,
			 enum counter_function *function)
{
	*function = COUNTER_FUNCTION_QUADRATURE_X4;
	return 0;
}

static int action_read(struct counter_device *counter, struct counter_count *count,
		       struct counter_synapse *synapse, enum counter_synapse_action *action)
{
	*action = COUNTER_SYNAPSE_ACTION_BOTH_EDGES;
	return 0;
}

static int watch_validate(struct counter_device *counter, const struct counter_watch *watch)
{
	switch (watch->event) {
	case COUNTER_EVENT_INDEX:
	case COUNTER_EVENT_CAPTURE:
		return watch->channel < 2 ? 0 : -EINVAL;
	default:
		return -EINVAL;
	}
}

static const struct counter_ops ops = {
	.count_read = count_read,
	.count_write = count_write,
	.function_read = function_read,
	.action_read = action_read,
	.watch_validate = watch_validate,
};

static int ceiling_read(struct counter_device *counter, struct counter_count *count, u64 *value)
{
	struct counter_sim *const sim = counter_priv(counter);

	*value = sim->ceiling;
	return 0;
}

static int ceiling_write(struct counter_device *counter, struct counter_count *count, u64 value)
{
	struct counter_sim *const sim = counter_priv(counter);

	sim->ceiling = value;
	return 0;
}

static int enable_read(struct counter_device *counter, struct counter_count *count, u8 *value)
{
	struct counter_sim *const sim = counter_priv(counter);

	*value = sim->enabled;
	return 0;
}

static int enable_write(struct counter_device *counter, struct counter_count *count, u8 value)
{
	struct counter_sim *const sim = counter_priv(counter);

	sim->enabled = value;
	return 0;
}

static int capture_read(struct counter_device *counter, struct counter_count *count, u64 *value)
{
	struct counter_sim *const sim = counter_priv(counter);

	*value = sim->captured;
	return 0;
}

static int index_pulse(struct counter_device *counter, u8 channel)
{
	counter_push_event(counter, COUNTER_EVENT_INDEX, channel);
	return 0;
}

static int capture_pulse(struct counter_device *counter, u8 channel)
{
	struct counter_sim *const sim = counter_priv(counter);

	sim->captured = sim->count;
	counter_push_event(counter, COUNTER_EVENT_CAPTURE, channel);
	return 0;
}

static struct counter_comp device_ext[] = {
	COUNTER_COMP_DEVICE_U8("index_pulse", NULL, index_pulse),
	COUNTER_COMP_DEVICE_U8("capture_pulse", NULL, capture_pulse),
};

static struct counter_comp count_ext[] = {
	COUNTER_COMP_CEILING(ceiling_read, ceiling_write),
	COUNTER_COMP_ENABLE(enable_read, enable_write),
	COUNTER_COMP_COUNT_U64("capture", capture_read, NULL),
};

static const enum counter_function functions[] = { COUNTER_FUNCTION_QUADRATURE_X4 };
static const enum counter_synapse_action actions[] = { COUNTER_SYNAPSE_ACTION_BOTH_EDGES };

static struct counter_signal signals[] = {
	{ .id = 0, .name = "A" },
	{ .id = 1, .name = "B" },
};

static struct counter_synapse synapses[] = {
	{ .actions_list = actions, .num_actions = ARRAY_SIZE(actions), .signal = &signals[0] },
	{ .actions_list = actions, .num_actions = ARRAY_SIZE(actions), .signal = &signals[1] },
};

static struct counter_count counts[] = {
	{
		.id = 0,
		.name = "Position",
		.functions_list = functions,
		.num_functions = ARRAY_SIZE(functions),
		.synapses = synapses,
		.num_synapses = ARRAY_SIZE(synapses),
		.ext = count_ext,
		.num_ext = ARRAY_SIZE(count_ext),
	},
};

static int counter_sim_probe(struct platform_device *pdev)
{
	struct counter_device *counter = devm_counter_alloc(&pdev->dev, sizeof(struct counter_sim));
	struct counter_sim *sim;

	if (!counter)
		return -ENOMEM;
	sim = counter_priv(counter);
	sim->ceiling = U32_MAX;
	sim->enabled = 1;
	counter->name = dev_name(&pdev->dev);
	counter->parent = &pdev->dev;
	counter->ops = &ops;
	counter->signals = signals;
	counter->num_signals = ARRAY_SIZE(signals);
	counter->counts = counts;
	counter->num_counts = ARRAY_SIZE(counts);
	counter->ext = device_ext;
	counter->num_ext = ARRAY_SIZE(device_ext);
	return devm_counter_add(&pdev->dev, counter);
}

static struct platform_driver counter_sim_driver = {
	.driver = { .name = "counter-sim" },
	.probe = counter_sim_probe,
};

static struct platform_device *devices[COUNTERS];

static int __init counter_sim_init(void)
{
	int i, err = platform_driver_register(&counter_sim_driver);

	for (i = 0; !err && i < COUNTERS; i++) {
		devices[i] = platform_device_register_simple("counter-sim", i, NULL, 0);
		err = PTR_ERR_OR_ZERO(devices[i]);
	}
	if (!err)
		return 0;
	while (--i > 0)
		platform_device_unregister(devices[i - 1]);
	platform_driver_unregister(&counter_sim_driver);
	return err;
}

static void __exit counter_sim_exit(void)
{
	int i;

	for (i = 0; i < COUNTERS; i++)
		platform_device_unregister(devices[i]);
	platform_driver_unregister(&counter_sim_driver);
}

module_init(counter_sim_init);
module_exit(counter_sim_exit);
MODULE_DESCRIPTION("Counter devices whose counts and events tests make");
MODULE_LICENSE("GPL");
MODULE_IMPORT_NS(COUNTER);

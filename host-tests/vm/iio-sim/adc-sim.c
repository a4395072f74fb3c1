// SPDX-License-Identifier: GPL-2.0
/*
 * A converter for tests, adc-sim.0: three channels of 24 bits, 0.001 mV a step. Writing "A B C" to its attribute convert puts
 * these values on the inputs and starts a conversion: a frame of the buffer, stamped by the kernel in the interrupt of the
 * converter's own trigger, as that of a ready signal. Unbind and bind the device to unplug it and plug it in.
 */
#include <linux/iio/buffer.h>
#include <linux/iio/iio.h>
#include <linux/iio/sysfs.h>
#include <linux/iio/trigger.h>
#include <linux/iio/trigger_consumer.h>
#include <linux/iio/triggered_buffer.h>
#include <linux/irq_work.h>
#include <linux/module.h>
#include <linux/platform_device.h>

#define CHANNELS 3

struct adc_sim {
	struct iio_trigger *ready;
	struct irq_work interrupt;
	s32 inputs[CHANNELS];
	struct {
		s32 values[CHANNELS];
		s64 stamp __aligned(8);
	} frame;
};

static int read_raw(struct iio_dev *dev, struct iio_chan_spec const *channel, int *value, int *value2, long mask)
{
	struct adc_sim *const sim = iio_priv(dev);

	switch (mask) {
	case IIO_CHAN_INFO_RAW:
		*value = sim->inputs[channel->channel];
		return IIO_VAL_INT;
	case IIO_CHAN_INFO_SCALE:
		*value = 0;
		*value2 = 1000;
		return IIO_VAL_INT_PLUS_MICRO;
	default:
		return -EINVAL;
	}
}

/* A trigger is polled in an interrupt. */
static void interrupt(struct irq_work *work)
{
	iio_trigger_poll(container_of(work, struct adc_sim, interrupt)->ready);
}

static ssize_t convert_store(struct device *dev, struct device_attribute *attr, const char *text, size_t size)
{
	struct adc_sim *const sim = iio_priv(dev_to_iio_dev(dev));
	int a, b, c;

	if (sscanf(text, "%d %d %d", &a, &b, &c) != CHANNELS)
		return -EINVAL;
	sim->inputs[0] = a;
	sim->inputs[1] = b;
	sim->inputs[2] = c;
	irq_work_queue(&sim->interrupt);
	irq_work_sync(&sim->interrupt);
	return size;
}

static IIO_DEVICE_ATTR(convert, 0200, NULL, convert_store, 0);

static struct attribute *attributes[] = { &iio_dev_attr_convert.dev_attr.attr, NULL };
static const struct attribute_group group = { .attrs = attributes };
static const struct iio_info info = { .attrs = &group, .read_raw = read_raw };

static irqreturn_t push_frame(int irq, void *data)
{
	struct iio_poll_func *const poll = data;
	struct adc_sim *const sim = iio_priv(poll->indio_dev);

	memcpy(sim->frame.values, sim->inputs, sizeof(sim->inputs));
	iio_push_to_buffers_with_timestamp(poll->indio_dev, &sim->frame, poll->timestamp);
	iio_trigger_notify_done(poll->indio_dev->trig);
	return IRQ_HANDLED;
}

#define INPUT(number) {							\
	.type = IIO_VOLTAGE,						\
	.indexed = 1,							\
	.channel = (number),						\
	.info_mask_separate = BIT(IIO_CHAN_INFO_RAW),			\
	.info_mask_shared_by_type = BIT(IIO_CHAN_INFO_SCALE),		\
	.scan_index = (number),						\
	.scan_type = { .sign = 's', .realbits = 24, .storagebits = 32, .endianness = IIO_CPU }, \
}

static const struct iio_chan_spec channels[] = { INPUT(0), INPUT(1), INPUT(2), IIO_CHAN_SOFT_TIMESTAMP(CHANNELS) };
/* It converts all channels at once; the core hands on those that were asked for. */
static const unsigned long scans[] = { BIT(CHANNELS) - 1, 0 };

static int adc_sim_probe(struct platform_device *pdev)
{
	struct iio_dev *const dev = devm_iio_device_alloc(&pdev->dev, sizeof(struct adc_sim));
	struct adc_sim *sim;
	int err;

	if (!dev)
		return -ENOMEM;
	sim = iio_priv(dev);
	init_irq_work(&sim->interrupt, interrupt);
	dev->name = "adc-sim.0";
	dev->modes = INDIO_DIRECT_MODE;
	dev->info = &info;
	dev->channels = channels;
	dev->num_channels = ARRAY_SIZE(channels);
	dev->available_scan_masks = scans;
	sim->ready = devm_iio_trigger_alloc(&pdev->dev, "adc-sim-ready");
	if (!sim->ready)
		return -ENOMEM;
	err = devm_iio_trigger_register(&pdev->dev, sim->ready);
	if (err)
		return err;
	dev->trig = iio_trigger_get(sim->ready);
	err = devm_iio_triggered_buffer_setup(&pdev->dev, dev, iio_pollfunc_store_time, push_frame, NULL);
	if (err)
		return err;
	return devm_iio_device_register(&pdev->dev, dev);
}

static struct platform_driver adc_sim_driver = {
	.driver = { .name = "adc-sim" },
	.probe = adc_sim_probe,
};

static struct platform_device *device;

static int __init adc_sim_init(void)
{
	int err = platform_driver_register(&adc_sim_driver);

	if (err)
		return err;
	device = platform_device_register_simple("adc-sim", 0, NULL, 0);
	if (!IS_ERR(device))
		return 0;
	platform_driver_unregister(&adc_sim_driver);
	return PTR_ERR(device);
}

static void __exit adc_sim_exit(void)
{
	platform_device_unregister(device);
	platform_driver_unregister(&adc_sim_driver);
}

module_init(adc_sim_init);
module_exit(adc_sim_exit);
MODULE_DESCRIPTION("A converter whose inputs and conversions tests make");
MODULE_LICENSE("GPL");

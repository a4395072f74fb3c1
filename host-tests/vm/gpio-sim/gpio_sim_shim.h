/*
 * When its chip is unplugged, gpio-sim frees the interrupts of lines that somebody still holds, and the holder's own
 * freeing them afterwards corrupts the kernel's memory. Here it waits for the holders, who are woken before, to let go.
 */
#include <linux/delay.h>
#include <linux/interrupt.h>
#include <linux/irqdomain.h>
#include <linux/jiffies.h>
static void dispose_when_let_go(unsigned int irq) {
	unsigned long patience = jiffies + 10 * HZ;
	while (irq != 0 && irq_has_action(irq) && time_before(jiffies, patience)) msleep(1);
	irq_dispose_mapping(irq);
}
#define irq_dispose_mapping(irq) dispose_when_let_go(irq)
